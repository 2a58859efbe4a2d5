#version 460
// y[r][o] = (sum_k weight[o][k] * x[r][k] + bias[o] + residual[r][o]) * scale.
// One invocation computes the four outputs of one quad of one row.
// Bindings: x, weight [out,in] row-major, bias [out], residual, y; x, residual and y as quads
// [features/4][rows].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bias { float bias[]; };
layout(set = 0, binding = 3, std430) readonly buffer Residual { vec4 residual[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.out_features + 3) / 4 * dims.rows) return;
    const uint row = i % dims.rows;
    const uint first = 4 * (i / dims.rows);
    const uint outputs = min(4, dims.out_features - first);
    vec4 value = vec4(0);
    for (uint k = 0; k < dims.in_features; ++k) {
        const float factor = x[((k / 4) * dims.rows + row) * 4 + k % 4];
        [[unroll]] for (uint lane = 0; lane < 4; ++lane)
            if (lane < outputs) value[lane] += weight[(first + lane) * dims.in_features + k] * factor;
    }
    if (dims.has_bias != 0)
        for (uint lane = 0; lane < outputs; ++lane) value[lane] += bias[first + lane];
    if (dims.has_residual != 0) value += residual[i];
    y[i] = value * dims.scale;
}
