#version 460
// grad_x[r][k] = scale * sum_o weight[o][k] * grad_y[r][o].
// One invocation computes the four gradients of one quad of one row.
// Bindings: weight [out,in] row-major, grad_y, grad_x; grad_y and grad_x as quads
// [features/4][rows].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 2, std430) writeonly buffer GradX { vec4 grad_x[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.in_features + 3) / 4 * dims.rows) return;
    const uint row = i % dims.rows;
    const uint first = 4 * (i / dims.rows);
    const uint inputs = min(4, dims.in_features - first);
    vec4 value = vec4(0);
    for (uint o = 0; o < dims.out_features; ++o) {
        const float factor = grad_y[((o / 4) * dims.rows + row) * 4 + o % 4];
        [[unroll]] for (uint lane = 0; lane < 4; ++lane)
            if (lane < inputs) value[lane] += weight[o * dims.in_features + first + lane] * factor;
    }
    grad_x[i] = value * dims.scale;
}
