#version 460
// Three interleaved tensors: part_j[n][c] = x[n][3c + j].
// One invocation computes one quad of each part. Bindings: x quads of 3c channels; a, b, c quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/split3_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, a);
QUADS_OUT(2, b);
QUADS_OUT(3, c);
layout(push_constant) uniform Push { Split3Params params; };

#include "launch.glsl"

vec4 quad_of(uint quad, uint column) {
    const uint last = (3 * params.c - 1) / 4;
    const vec4 value = LD4(x, min(quad, last) * params.columns + column);
    return quad <= last ? value : vec4(0);
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.c + 3) / 4 * params.columns) return;
    const uint first = 3 * (i / params.columns);
    const uint column = i % params.columns;
    const vec4 u = quad_of(first, column);
    const vec4 v = quad_of(first + 1, column);
    const vec4 w = quad_of(first + 2, column);
    ST4(a, i, vec4(u.x, u.w, v.z, w.y));
    ST4(b, i, vec4(u.y, v.x, v.w, w.z));
    ST4(c, i, vec4(u.z, v.y, w.x, w.w));
}
