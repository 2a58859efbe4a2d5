#version 460
// grad_x[n][3c + j] = grad_part_j[n][c].
// One invocation computes three quads of grad_x. Bindings: grad_a, grad_b, grad_c quads; grad_x quads of
// 3c channels.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/split3_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_a);
QUADS(1, grad_b);
QUADS(2, grad_c);
QUADS_OUT(3, grad_x);
layout(push_constant) uniform Push { Split3Params params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.c + 3) / 4 * params.columns) return;
    const uint first = 3 * (i / params.columns);
    const uint quads = (3 * params.c + 3) / 4;
    const uint at = first * params.columns + i % params.columns;
    const vec4 a = LD4(grad_a, i);
    const vec4 b = LD4(grad_b, i);
    const vec4 c = LD4(grad_c, i);
    ST4(grad_x, at, vec4(a.x, b.x, c.x, a.y));
    if (first + 1 < quads) ST4(grad_x, at + params.columns, vec4(b.y, c.y, a.z, b.z));
    if (first + 2 < quads) ST4(grad_x, at + 2 * params.columns, vec4(c.z, a.w, b.w, c.w));
}
