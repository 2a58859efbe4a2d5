#version 460
// Like group_norm_backward.comp, a quad of channels at a time: needs C/G divisible by 4.
// One workgroup computes one (n, g); lanes run along the pixels of one quad.
// Bindings: x, gamma, beta (read as quads), mean [2,N,G], rstd, grad_y, grad_x, sums [N,C] vec2.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/group_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, gamma);
QUADS(2, beta);
layout(set = 0, binding = 3, std430) readonly buffer Mean { float mean_in[]; };
layout(set = 0, binding = 4, std430) readonly buffer Rstd { float rstd_in[]; };
QUADS(5, grad_y);
QUADS_OUT(6, grad_x);
layout(set = 0, binding = 7, std430) writeonly buffer Sums { vec2 sums[]; };
layout(push_constant) uniform Push { GroupNormParams dims; };

#include "reduce.glsl"
#include "activations/silu.glsl"

const uint kUnroll = 2;

void main() {
    const uint g = gl_WorkGroupID.x;
    const uint n = gl_WorkGroupID.y;
    const uint quads = dims.c / dims.groups / 4;
    const uint columns = dims.n * dims.p;
    const uint start = g * quads * columns + n * dims.p;
    const uint lane = gl_LocalInvocationID.x;
    const uint step = gl_WorkGroupSize.x;
    const uint whole = dims.p / (kUnroll * step) * (kUnroll * step);
    const float mean = mean_in[n * dims.groups + g];
    const float rstd = rstd_in[n * dims.groups + g];
    const float rest = mean_in[(dims.n + n) * dims.groups + g] * rstd;
    const bool fused = dims.silu != 0;

    vec2 total = vec2(0);
    for (uint q = 0; q < quads; ++q) {
        const vec4 scale = LD4(gamma, g * quads + q);
        const vec4 shift = LD4(beta, g * quads + q);
        const uint at = start + q * columns + lane;
        vec4 first = vec4(0);
        vec4 second = vec4(0);
        for (uint i = 0; i < whole; i += kUnroll * step)
            [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
                const vec4 xhat = (LD4(x, at + i + u * step) - mean) * rstd - rest;
                vec4 grad_t = LD4(grad_y, at + i + u * step);
                if (fused) grad_t *= silu_derivative(scale * xhat + shift);
                first += grad_t;
                second += grad_t * xhat;
            }
        for (uint i = whole; i + lane < dims.p; i += step) {
            const vec4 xhat = (LD4(x, at + i) - mean) * rstd - rest;
            vec4 grad_t = LD4(grad_y, at + i);
            if (fused) grad_t *= silu_derivative(scale * xhat + shift);
            first += grad_t;
            second += grad_t * xhat;
        }
        first = workgroup_sum(first);
        second = workgroup_sum(second);
        if (lane < 4) sums[n * dims.c + 4 * (g * quads + q) + lane] = vec2(first[lane], second[lane]);
        total += vec2(dot(scale, first), dot(scale, second));
    }
    const vec2 average = total / float(4 * quads * dims.p);

    for (uint q = 0; q < quads; ++q) {
        const vec4 scale = LD4(gamma, g * quads + q);
        const vec4 shift = LD4(beta, g * quads + q);
        const uint at = start + q * columns + lane;
        for (uint i = 0; i + lane < dims.p; i += step) {
            const vec4 xhat = (LD4(x, at + i) - mean) * rstd - rest;
            vec4 grad_t = LD4(grad_y, at + i);
            if (fused) grad_t *= silu_derivative(scale * xhat + shift);
            ST4(grad_x, at + i, rstd * (scale * grad_t - average.x - xhat * average.y));
        }
    }
}
