#version 460
// grad_weight[k][c][r] = matrix[r][k][c], the inverse of conv2d_taps_forward_weight.comp for gradients; adds to the
// existing values when accumulate is set.
// One invocation computes one weight. Workgroups: see launch.glsl.
// Bindings: matrix [9][4*ceil(K/4)][C], grad_weight [K,C,3,3] row-major.
#extension GL_GOOGLE_include_directive : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Matrix { float matrix[]; };
layout(set = 0, binding = 1, std430) buffer GradWeight { float grad_weight[]; };  // accumulates
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.out_channels * dims.in_channels * 9) return;
    const uint rows = (dims.out_channels + 3) / 4 * 4;
    const uint tap = i % 9;
    const uint c = i / 9 % dims.in_channels;
    const uint k = i / 9 / dims.in_channels;
    const float value = matrix[(tap * rows + k) * dims.in_channels + c];
    grad_weight[i] = dims.accumulate != 0 ? grad_weight[i] + value : value;
}
