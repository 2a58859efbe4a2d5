#version 460
// With xhat = (x - mean) * rstd, t = gamma * xhat + beta and grad_t = grad_y (times silu'(t) where
// fused):
//   sums[n,c] = (sum_p grad_t, sum_p grad_t * xhat)      grad_beta and grad_gamma before the sum
//   over n
//   grad_x = rstd * (gamma * grad_t - a - xhat * b),  a = mean over the group of gamma * grad_t, b
//   = of gamma * grad_t * xhat
// One workgroup computes one (n, g).
// Bindings: x, gamma, beta, mean [2,N,G] (rounded, and the rest), rstd, grad_y, grad_x, sums [N,C] vec2; x,
// grad_y, grad_x as quads [C/4][N*P].
#extension GL_GOOGLE_include_directive : require
#include "params/group_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Gamma { float gamma[]; };
layout(set = 0, binding = 2, std430) readonly buffer Beta { float beta[]; };
layout(set = 0, binding = 3, std430) readonly buffer Mean { float mean[]; };
layout(set = 0, binding = 4, std430) readonly buffer Rstd { float rstd[]; };
layout(set = 0, binding = 5, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 6, std430) writeonly buffer GradX { float grad_x[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Sums { vec2 sums[]; };
layout(push_constant) uniform Push { GroupNormParams dims; };

#include "reduce.glsl"
#include "activations/silu.glsl"

uint place(uint c, uint p) { return ((c / 4) * dims.n * dims.p + gl_WorkGroupID.y * dims.p + p) * 4 + c % 4; }

float grad_t(uint c, uint at, float xhat) {
    return dims.silu != 0 ? grad_y[at] * silu_derivative(gamma[c] * xhat + beta[c]) : grad_y[at];
}

void main() {
    const uint n = gl_WorkGroupID.y;
    const uint group = n * dims.groups + gl_WorkGroupID.x;
    const float rest = mean[dims.n * dims.groups + group];
    const uint channels = dims.c / dims.groups;
    const uint first = gl_WorkGroupID.x * channels;
    const uint lane = gl_LocalInvocationID.x;
    const uint step = gl_WorkGroupSize.x;

    vec2 total = vec2(0);
    for (uint c = first; c < first + channels; ++c) {
        vec2 sum = vec2(0);
        for (uint p = lane; p < dims.p; p += step) {
            const uint at = place(c, p);
            const float xhat = ((x[at] - mean[group]) - rest) * rstd[group];
            sum += grad_t(c, at, xhat) * vec2(1, xhat);
        }
        sum = workgroup_sum(sum);
        if (lane == 0) sums[n * dims.c + c] = sum;
        total += gamma[c] * sum;
    }
    const uint count = channels * dims.p;
    const vec2 average = count == 1 ? total : total / float(count);  // a quotient by 1 may be inexact

    for (uint c = first; c < first + channels; ++c)
        for (uint p = lane; p < dims.p; p += step) {
            const uint at = place(c, p);
            const float xhat = ((x[at] - mean[group]) - rest) * rstd[group];
            grad_x[at] = rstd[group] * (gamma[c] * grad_t(c, at, xhat) - average.x - xhat * average.y);
        }
    if (gl_WorkGroupID.x == dims.groups - 1)
        for (uint c = dims.c; c % 4 != 0; ++c)
            for (uint p = lane; p < dims.p; p += step) grad_x[place(c, p)] = 0;
}
