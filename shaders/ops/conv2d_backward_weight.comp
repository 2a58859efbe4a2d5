#version 460
// partial[s][r][c] of every output channel k: the sum of grad_y[k][p] * x[c][p + (r/3-1, r%3-1)] over the
// pixels p of slice s of the rows, r running over the nine taps. Each row is summed, then the rows: over the
// 10^5 pixels of an image one running sum would cost two digits. conv2d_backward_weight_reduce.comp sums the
// slices.
// One invocation computes one weight of one slice.
// Bindings: x, grad_y, partial [slices][9][K][ceil(C/4) * 4]; x and grad_y as quads [channels/4][N*H*W].
#extension GL_GOOGLE_include_directive : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Partial { float partial[]; };
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "conv2d_slices.glsl"
#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.out_channels * dims.in_channels * 9) return;
    const uint c = i % dims.in_channels;
    const uint k = i / dims.in_channels % dims.out_channels;
    const uint tap = i / dims.in_channels / dims.out_channels;
    const int down = int(tap / 3) - 1;
    const int right = int(tap % 3) - 1;
    const uint pixels = dims.n * dims.height * dims.width;
    const int begin = max(0, -right);
    const int end = int(dims.width) - max(0, right);
    float total = 0;
    for (uint row = slice_begin(gl_WorkGroupID.z); row < slice_end(gl_WorkGroupID.z); ++row) {
        const int near_row = int(row % dims.height) + down;
        if (near_row < 0 || near_row >= int(dims.height)) continue;
        float sum = 0;
        for (int column = begin; column < end; ++column) {
            const uint pixel = row * dims.width + uint(column);
            const uint near = uint(int(pixel) + down * int(dims.width) + right);
            sum += grad_y[((k / 4) * pixels + pixel) * 4 + k % 4] * x[((c / 4) * pixels + near) * 4 + c % 4];
        }
        total += sum;
    }
    const uint padded = (dims.in_channels + 3) / 4 * 4;
    partial[((gl_WorkGroupID.z * 9 + tap) * dims.out_channels + k) * padded + c] = total;
}
