#version 460
// grad_weight[k][c][r] = scale * sum_s partial[s][r][k][c], r running over the nine taps; adds to the
// existing values when accumulate is set.
// One invocation computes one weight.
// Bindings: partial [slices][9][K][ceil(C/4) * 4], grad_weight [K,C,3,3] row-major.
#extension GL_GOOGLE_include_directive : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Partial { float partial[]; };
layout(set = 0, binding = 1, std430) buffer GradWeight { float grad_weight[]; };  // accumulates
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.out_channels * dims.in_channels * 9) return;
    const uint padded = (dims.in_channels + 3) / 4 * 4;
    const uint tap = i % 9;
    const uint c = i / 9 % dims.in_channels;
    const uint k = i / 9 / dims.in_channels;
    const uint at = (tap * dims.out_channels + k) * padded + c;
    float total = 0;
    for (uint s = 0; s < dims.slices; ++s) total += partial[s * 9 * dims.out_channels * padded + at];
    total *= dims.scale;
    grad_weight[i] = dims.accumulate != 0 ? grad_weight[i] + total : total;
}
