#version 460
// grad_weight[o][k] = scale * sum_s partial[s][o][k], added to the existing values when accumulate is set.
// One invocation computes one weight.
// Bindings: partial [slices][out][ceil(in/4) * 4], grad_weight [out,in] row-major.
#extension GL_GOOGLE_include_directive : require
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
    float total = 0;
    for (uint s = 0; s < dims.slices; ++s) total += partial[s * dims.out_features * padded + at];
    total *= dims.scale;
    grad_weight[i] = dims.accumulate != 0 ? grad_weight[i] + total : total;
}
