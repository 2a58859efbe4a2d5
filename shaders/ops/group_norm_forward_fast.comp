#version 460
// As group_norm_forward.comp, a quad of channels at a time: needs C/G divisible by 4.
// One workgroup computes one (n, g); lanes run along the pixels of one quad.
// Bindings: x, gamma, beta (read as quads), y, mean [N,G], rstd [N,G].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/group_norm_params.h"

layout(local_size_x_id = 0) in;
QUADS(0, x);
QUADS(1, gamma);
QUADS(2, beta);
layout(set = 0, binding = 3, std430) writeonly buffer Y { vec4 y[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Mean { float mean_out[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Rstd { float rstd_out[]; };
layout(push_constant) uniform Push { GroupNormParams dims; };

#include "reduce.glsl"
#include "silu.glsl"

// Loads per loop turn: enough work to hide the loop's masking on lavapipe.
const uint kUnroll = 4;

void main() {
    const uint g = gl_WorkGroupID.x;
    const uint n = gl_WorkGroupID.y;
    const uint quads = dims.c / dims.groups / 4;
    const uint columns = dims.n * dims.p;
    const uint start = g * quads * columns + n * dims.p;
    const uint lane = gl_LocalInvocationID.x;
    const uint step = gl_WorkGroupSize.x;
    const uint whole = dims.p / (kUnroll * step) * (kUnroll * step);
    const float per_count = 1.0 / float(4 * quads * dims.p);
    const float per_root = sqrt(per_count);

    vec4 sum = vec4(0);
    for (uint q = 0; q < quads; ++q) {
        const uint at = start + q * columns + lane;
        for (uint i = 0; i < whole; i += kUnroll * step)
            [[unroll]] for (uint u = 0; u < kUnroll; ++u) sum += LD4(x, at + i + u * step) * per_count;
        for (uint i = whole; i + lane < dims.p; i += step) sum += LD4(x, at + i) * per_count;
    }
    sum = workgroup_sum(sum);
    const float guess = (sum.x + sum.y) + (sum.z + sum.w);

    vec4 residual = vec4(0);
    vec4 square = vec4(0);
    for (uint q = 0; q < quads; ++q) {
        const uint at = start + q * columns + lane;
        for (uint i = 0; i < whole; i += kUnroll * step)
            [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
                const vec4 d = LD4(x, at + i + u * step) - guess;
                residual += d * per_count;
                square += (d * per_root) * (d * per_root);
            }
        for (uint i = whole; i + lane < dims.p; i += step) {
            const vec4 d = LD4(x, at + i) - guess;
            residual += d * per_count;
            square += (d * per_root) * (d * per_root);
        }
    }
    const vec2 moments = workgroup_sum(vec2((residual.x + residual.y) + (residual.z + residual.w),
                                            (square.x + square.y) + (square.z + square.w)));
    const float mean = guess + moments.x;
    const float rstd = 1.0 / sqrt(max(moments.y - moments.x * moments.x, 0.0) + dims.eps);

    for (uint q = 0; q < quads; ++q) {
        const vec4 scale = LD4(gamma, g * quads + q);
        const vec4 shift = LD4(beta, g * quads + q);
        const uint at = start + q * columns + lane;
        if (dims.silu != 0) {
            for (uint i = 0; i + lane < dims.p; i += step)
                y[at + i] = silu(scale * ((LD4(x, at + i) - mean) * rstd) + shift);
        } else {
            for (uint i = 0; i + lane < dims.p; i += step) y[at + i] = scale * ((LD4(x, at + i) - mean) * rstd) + shift;
        }
    }
    if (lane == 0) {
        mean_out[n * dims.groups + g] = mean;
        rstd_out[n * dims.groups + g] = rstd;
    }
}
