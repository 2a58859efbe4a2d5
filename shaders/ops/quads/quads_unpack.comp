#version 460
// Quads to row-major: y[n][c][p] = x[c/4][n*P + p][c%4]. One invocation reads one quad.
// Bindings: x [ceil(C/4)][N*P] vec4, y [N,C,P].
#extension GL_GOOGLE_include_directive : require
#include "params/quads_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { vec4 x[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Y { float y[]; };
layout(push_constant) uniform Push { QuadsParams dims; };

#include "launch.glsl"

void main() {
    const uint columns = dims.n * dims.p;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.c + 3) / 4 * columns) return;
    const uint q = i / columns;
    const uint n = i % columns / dims.p;
    const uint p = i % dims.p;
    const vec4 value = x[i];
    for (uint k = 0; k < 4 && 4 * q + k < dims.c; ++k) y[(n * dims.c + 4 * q + k) * dims.p + p] = value[k];
}
