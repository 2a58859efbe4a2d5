#version 460
// With xhat = (x - mean) * rstd and h = gamma * grad_y:
//   grad_x = rstd * (h - a - xhat * b),  a = mean over the channels of h, b = of h * xhat
// A workgroup has its size / kLanes pixels; kLanes invocations share the quads of a pixel.
// Bindings: x, gamma (read as quads), mean [2,N*P], rstd [N*P], grad_y, grad_x. Specialisation: kLanes.
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/layer_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, gamma);
layout(set = 0, binding = 2, std430) readonly buffer Mean { float mean_in[]; };
layout(set = 0, binding = 3, std430) readonly buffer Rstd { float rstd_in[]; };
QUADS(4, grad_y);
QUADS_OUT(5, grad_x);
layout(push_constant) uniform Push { LayerNormParams dims; };

#include "norms/layer_norm.glsl"

void main() {
    const uint own = column_of(dims.groups_x);
    const uint column = min(own, dims.columns - 1);
    const uint whole = dims.channels / 4;
    const float mean = mean_in[column];
    const float rstd = rstd_in[column];
    const float rest = mean_in[dims.columns + column] * rstd;

    vec4 a = vec4(0);
    vec4 b = vec4(0);
    uint q = first_quad();
    for (; q + (kUnroll - 1) * kLanes < whole; q += kUnroll * kLanes)
        [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
            const uint at = (q + u * kLanes) * dims.columns + column;
            const vec4 h = LD4(gamma, q + u * kLanes) * LD4(grad_y, at);
            a += h;
            b += h * ((LD4(x, at) - mean) * rstd - rest);
        }
    for (; 4 * q < dims.channels; q += kLanes) {
        const uint at = q * dims.columns + column;
        const vec4 h = channels_below(LD4(gamma, q) * LD4(grad_y, at), 4 * q, dims.channels);
        a += h;
        b += h * ((LD4(x, at) - mean) * rstd - rest);
    }
    const vec2 all = sum_of_lanes(vec4(across(a), across(b), 0, 0)).xy;
    const vec2 average = dims.channels == 1 ? all : all / float(dims.channels);  // a quotient by 1 may be inexact

    if (own >= dims.columns) return;
    for (q = first_quad(); q + (kUnroll - 1) * kLanes < whole; q += kUnroll * kLanes)
        [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
            const uint at = (q + u * kLanes) * dims.columns + column;
            const vec4 xhat = (LD4(x, at) - mean) * rstd - rest;
            ST4(grad_x, at, rstd * (LD4(gamma, q + u * kLanes) * LD4(grad_y, at) - average.x - xhat * average.y));
        }
    for (; 4 * q < dims.channels; q += kLanes) {
        const uint at = q * dims.columns + column;
        const vec4 xhat = (LD4(x, at) - mean) * rstd - rest;
        const vec4 value = rstd * (LD4(gamma, q) * LD4(grad_y, at) - average.x - xhat * average.y);
        ST4(grad_x, at, channels_below(value, 4 * q, dims.channels));
    }
}
