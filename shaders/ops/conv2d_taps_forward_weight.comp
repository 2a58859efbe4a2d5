#version 460
// matrix[r][k][c] = weight[k][c][r] of the nine taps r, zero for the rows k from K on: the weight as the matrix of a
// linear layer of 9 * 4 * ceil(K/4) outputs.
// One invocation writes one element. Workgroups: see launch.glsl.
// Bindings: weight [K,C,3,3] row-major, matrix [9][4*ceil(K/4)][C].
#extension GL_GOOGLE_include_directive : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Matrix { float matrix[]; };
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint rows = (dims.out_channels + 3) / 4 * 4;
    const uint i = invocation_index(dims.groups_x);
    if (i >= 9 * rows * dims.in_channels) return;
    const uint c = i % dims.in_channels;
    const uint k = i / dims.in_channels % rows;
    const uint tap = i / dims.in_channels / rows;
    matrix[i] = k < dims.out_channels ? weight[(k * dims.in_channels + c) * 9 + tap] : 0;
}
