#version 460
// y = gamma[c] * (x - mean[n,g]) * rstd[n,g] + beta[c], then optionally y = silu(y);  rstd =
// 1/sqrt(var + eps), var biased.
// Two passes over the group: the mean about the first element, then the variance about that mean; its residual
// r corrects both (mean += r, var -= r^2). If a square overflows, once more with x times kShrink.
// One workgroup computes one (n, g). Bindings: x, gamma, beta, y, mean [2,N,G] (group_norm.glsl), rstd [N,G]; x
// and y as quads [C/4][N*P].
#extension GL_GOOGLE_include_directive : require
#include "params/group_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Gamma { float gamma[]; };
layout(set = 0, binding = 2, std430) readonly buffer Beta { float beta[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Y { float y[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Mean { float mean_out[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Rstd { float rstd_out[]; };
layout(push_constant) uniform Push { GroupNormParams dims; };

#include "norms/group_norm.glsl"
#include "reduce.glsl"
#include "activations/silu.glsl"

uint place(uint c, uint p) { return ((c / 4) * dims.n * dims.p + gl_WorkGroupID.y * dims.p + p) * 4 + c % 4; }

void main() {
    const uint g = gl_WorkGroupID.x;
    const uint n = gl_WorkGroupID.y;
    const uint channels = dims.c / dims.groups;
    const uint count = channels * dims.p;
    const uint lane = gl_LocalInvocationID.x;
    const uint step = gl_WorkGroupSize.x;
    const uint first = g * channels;

    float unit = 1.0;
    float guess = 0;
    vec2 moments = vec2(0);
    for (uint attempt = 0; attempt < 2; ++attempt) {
        const float pivot = x[place(first, 0)] * unit;
        float sum = 0;
        for (uint i = lane; i < count; i += step)
            sum += x[place(first + i / dims.p, i % dims.p)] * unit - pivot;
        guess = pivot + workgroup_sum(sum) / float(count);

        moments = vec2(0);
        for (uint i = lane; i < count; i += step) {
            const float d = x[place(first + i / dims.p, i % dims.p)] * unit - guess;
            moments += vec2(d, d * d);
        }
        moments = workgroup_sum(moments) / float(count);
        if (finite(moments.y) || attempt == 1) break;
        unit = kShrink;
    }
    const vec2 mean = split_mean(guess, moments.x);
    const float rstd = inverse_deviation(moments.y - moments.x * moments.x, dims.eps, unit);

    for (uint i = lane; i < count; i += step) {
        const uint c = first + i / dims.p;
        const uint at = place(c, i % dims.p);
        const float t = gamma[c] * (((x[at] * unit - mean.x) - mean.y) * rstd) + beta[c];
        y[at] = dims.silu != 0 ? silu(t) : t;
    }
    if (lane == 0) {
        mean_out[n * dims.groups + g] = mean.x * per_unit(unit);
        mean_out[(dims.n + n) * dims.groups + g] = mean.y * per_unit(unit);
        rstd_out[n * dims.groups + g] = rstd * unit;
    }
    // The last quad's missing channels are zero by convention.
    if (g == dims.groups - 1)
        for (uint c = dims.c; c % 4 != 0; ++c)
            for (uint p = lane; p < dims.p; p += step) y[place(c, p)] = 0;
}
