#version 460
// grad_weight[o][k] = scale * sum_s partial[s][o][k], added to the existing values when accumulate is set.
// One invocation computes one weight.
// Bindings: partial [slices][out][ceil(in/4) * 4], grad_weight [out,in] row-major.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Partial { float partial[]; };
layout(set = 0, binding = 1, std430) buffer GradWeight { float grad_weight[]; };  // accumulates
layout(push_constant) uniform Push { LinearParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.out_features * dims.in_features) return;
    const uint padded = (dims.in_features + 3) / 4 * 4;
    const uint at = i / dims.in_features * padded + i % dims.in_features;
    const uint step = dims.out_features * padded;
    float total = 0;
    uint s = 0;
    for (; s + 8 <= dims.slices; s += 8) {  // eight loads are under way together
        float values[8];
        [[unroll]] for (uint u = 0; u < 8; ++u) values[u] = partial[(s + u) * step + at];
        [[unroll]] for (uint u = 0; u < 8; ++u) total += values[u];
    }
    for (; s < dims.slices; ++s) total += partial[s * step + at];
    total *= dims.scale;
    grad_weight[i] = dims.accumulate != 0 ? grad_weight[i] + total : total;
}
