#version 460
// grad_x[c][p] = scale * sum_{k,r,s} weight[k][c][r][s] * grad_y[k][p - (r-1, s-1)], grad_y being zero
// outside the image.
// One invocation computes the four gradients of one quad of one pixel.
// Bindings: weight [K,C,3,3] row-major, grad_y, grad_x; the latter two as quads [channels/4][N*H*W].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 2, std430) writeonly buffer GradX { vec4 grad_x[]; };
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint pixels = dims.n * dims.height * dims.width;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.in_channels + 3) / 4 * pixels) return;
    const uint pixel = i % pixels;
    const int row = int(pixel / dims.width % dims.height);
    const int column = int(pixel % dims.width);
    const uint first = 4 * (i / pixels);
    const uint inputs = min(4, dims.in_channels - first);
    vec4 value = vec4(0);
    for (uint k = 0; k < dims.out_channels; ++k) {
        vec4 sum = vec4(0);
        for (int r = 0; r < 3; ++r)
            for (int s = 0; s < 3; ++s) {
                const ivec2 at = ivec2(row - r + 1, column - s + 1);
                if (any(lessThan(at, ivec2(0))) || at.x >= int(dims.height) || at.y >= int(dims.width)) continue;
                const int near = int(pixel) - (r - 1) * int(dims.width) - (s - 1);
                const float factor = grad_y[((k / 4) * pixels + uint(near)) * 4 + k % 4];
                [[unroll]] for (uint lane = 0; lane < 4; ++lane)
                    if (lane < inputs)
                        sum[lane] += weight[(k * dims.in_channels + first + lane) * 9 + uint(3 * r + s)] * factor;
            }
        value += sum;
    }
    grad_x[i] = value * dims.scale;
}
