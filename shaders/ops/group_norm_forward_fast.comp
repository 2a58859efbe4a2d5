#version 460
// Like group_norm_forward.comp, a quad of channels at a time: needs C/G divisible by 4.
// One workgroup computes one (n, g); lanes run along the pixels of one quad.
// Bindings: x, gamma, beta (read as quads), y, mean [2,N,G], rstd [N,G].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/group_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, gamma);
QUADS(2, beta);
QUADS_OUT(3, y);
layout(set = 0, binding = 4, std430) writeonly buffer Mean { float mean_out[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Rstd { float rstd_out[]; };
layout(push_constant) uniform Push { GroupNormParams dims; };

#include "norms/group_norm.glsl"
#include "reduce.glsl"
#include "activations/silu.glsl"

// Loads per loop turn: enough work to hide the loop's masking on lavapipe.
const uint kUnroll = 4;

float across(vec4 v) { return (v.x + v.y) + (v.z + v.w); }

void main() {
    const uint g = gl_WorkGroupID.x;
    const uint n = gl_WorkGroupID.y;
    const uint quads = dims.c / dims.groups / 4;
    const uint columns = dims.n * dims.p;
    const uint start = g * quads * columns + n * dims.p;
    const uint lane = gl_LocalInvocationID.x;
    const uint step = gl_WorkGroupSize.x;
    const uint pixels = dims.p;
    const uint whole = pixels / (kUnroll * step) * (kUnroll * step);
    const float count = float(4 * quads * pixels);

    float unit = 1.0;
    float guess = 0;
    vec2 moments = vec2(0);
    for (uint attempt = 0; attempt < 2; ++attempt) {
        const float pivot = LD4(x, start).x * unit;
        vec4 sum = vec4(0);
        uint q = 0;
        do {
            const uint at = start + q * columns + lane;
            vec4 of_quad = vec4(0);
            for (uint i = 0; i < whole; i += kUnroll * step)
                [[unroll]] for (uint u = 0; u < kUnroll; ++u)
                    of_quad += LD4(x, at + i + u * step) * unit - pivot;
            for (uint i = whole; i + lane < pixels; i += step) of_quad += LD4(x, at + i) * unit - pivot;
            sum += of_quad;
        } while (++q < quads);
        guess = pivot + across(workgroup_sum(sum)) / count;

        vec4 residual = vec4(0);
        vec4 square = vec4(0);
        q = 0;
        do {
            const uint at = start + q * columns + lane;
            vec4 first = vec4(0);
            vec4 second = vec4(0);
            for (uint i = 0; i < whole; i += kUnroll * step)
                [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
                    const vec4 d = LD4(x, at + i + u * step) * unit - guess;
                    first += d;
                    second += d * d;
                }
            for (uint i = whole; i + lane < pixels; i += step) {
                const vec4 d = LD4(x, at + i) * unit - guess;
                first += d;
                second += d * d;
            }
            residual += first;
            square += second;
        } while (++q < quads);
        moments = workgroup_sum(vec2(across(residual), across(square))) / count;
        if (finite(moments.y) || attempt == 1) break;
        unit = kShrink;
    }
    const vec2 mean = split_mean(guess, moments.x);
    const float rstd = inverse_deviation(moments.y - moments.x * moments.x, dims.eps, unit);

    const bool fused = dims.silu != 0;
    uint q = 0;
    do {
        const vec4 scale = LD4(gamma, g * quads + q) * rstd;
        const vec4 shift = LD4(beta, g * quads + q) - scale * mean.y;
        const uint at = start + q * columns + lane;
        for (uint i = 0; i < whole; i += kUnroll * step)
            [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
                const vec4 t = scale * (LD4(x, at + i + u * step) * unit - mean.x) + shift;
                ST4(y, at + i + u * step, fused ? silu(t) : t);
            }
        for (uint i = whole; i + lane < pixels; i += step) {
            const vec4 t = scale * (LD4(x, at + i) * unit - mean.x) + shift;
            ST4(y, at + i, fused ? silu(t) : t);
        }
    } while (++q < quads);
    if (lane == 0) {
        mean_out[n * dims.groups + g] = mean.x * per_unit(unit);
        mean_out[(dims.n + n) * dims.groups + g] = mean.y * per_unit(unit);
        rstd_out[n * dims.groups + g] = rstd * unit;
    }
}
