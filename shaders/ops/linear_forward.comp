#version 460
// y[r][o] = sum_k weight[o][k] * x[r][k] + bias[o].
// One invocation computes the four outputs of one quad of one row.
// Bindings: x, weight [out,in] row-major, bias [out], y; x and y as quads [features/4][rows].
#extension GL_GOOGLE_include_directive : require
#include "params/linear_params.h"

layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bias { float bias[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.out_features + 3) / 4 * dims.rows) return;
    const uint row = i % dims.rows;
    vec4 value = vec4(0);
    for (uint lane = 0; lane < 4; ++lane) {
        const uint o = 4 * (i / dims.rows) + lane;
        if (o >= dims.out_features) break;
        float sum = 0;
        for (uint k = 0; k < dims.in_features; ++k)
            sum += weight[o * dims.in_features + k] * x[((k / 4) * dims.rows + row) * 4 + k % 4];
        value[lane] = dims.has_bias != 0 ? sum + bias[o] : sum;
    }
    y[i] = value;
}
