#version 460
// Row-major bytes k to quads of the float32 nearest to k / 255, zero beyond the last channel:
// y[q][n*P + p] = (x[n][4q][p], ..., x[n][4q+3][p]) / 255.
//
//   k / 255 = (257 k + k / 255) / 65536
//
// 257 k is exact, and k / 255 has a period of 8 bits, so no float32 sum of both rounds to a neighbour, fused or not; a
// division may. One invocation writes one quad. Bindings: x [N,C,P] bytes, y [ceil(C/4)][N*P] vec4.
#extension GL_GOOGLE_include_directive : require
#include "params/quads_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { uint x[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { QuadsParams dims; };

#include "launch.glsl"

const float kHigh = 1.0 / 65536.0, kLow = 1.0 / (65536.0 * 255.0);

void main() {
    const uint columns = dims.n * dims.p;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.c + 3) / 4 * columns) return;
    const uint q = i / columns;
    const uint n = i % columns / dims.p;
    const uint p = i % dims.p;
    vec4 value = vec4(0);
    for (uint k = 0; k < 4 && 4 * q + k < dims.c; ++k) {
        const uint at = (n * dims.c + 4 * q + k) * dims.p + p;
        const uint level = x[at / 4] >> 8 * (at % 4) & 255u;
        value[k] = float(257 * level) * kHigh + float(level) * kLow;
    }
    y[i] = value;
}
