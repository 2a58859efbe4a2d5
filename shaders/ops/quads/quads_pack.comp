#version 460
// Row-major to quads: y[q][n*P + p] = (x[n][4q][p], ..., x[n][4q+3][p]), zero beyond the last
// channel.
// One invocation writes one quad. Bindings: x [N,C,P], y [ceil(C/4)][N*P] vec4.
#extension GL_GOOGLE_include_directive : require
#include "params/quads_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { QuadsParams dims; };

#include "launch.glsl"

void main() {
    const uint columns = dims.n * dims.p;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.c + 3) / 4 * columns) return;
    const uint q = i / columns;
    const uint n = i % columns / dims.p;
    const uint p = i % dims.p;
    vec4 value = vec4(0);
    for (uint k = 0; k < 4 && 4 * q + k < dims.c; ++k) value[k] = x[(n * dims.c + 4 * q + k) * dims.p + p];
    y[i] = value;
}
