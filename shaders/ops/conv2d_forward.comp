#version 460
// y[k][p] = (sum_{c,r,s} weight[k][c][r][s] * x[c][p + (r-1, s-1)] + bias[k] + residual[k][p]) * scale,
// x being zero outside the image or, if dims.replicate, its nearest pixel.
// One invocation computes the four outputs of one quad of one pixel.
// Bindings: x, weight [K,C,3,3] row-major, bias [K], residual, y; x, residual and y as quads
// [channels/4][N*H*W].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bias { float bias[]; };
layout(set = 0, binding = 3, std430) readonly buffer Residual { vec4 residual[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint pixels = dims.n * dims.height * dims.width;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.out_channels + 3) / 4 * pixels) return;
    const uint pixel = i % pixels;
    const int row = int(pixel / dims.width % dims.height);
    const int column = int(pixel % dims.width);
    const uint first = 4 * (i / pixels);
    const uint outputs = min(4, dims.out_channels - first);
    vec4 value = vec4(0);
    for (uint c = 0; c < dims.in_channels; ++c) {
        vec4 sum = vec4(0);
        for (int r = 0; r < 3; ++r)
            for (int s = 0; s < 3; ++s) {
                const ivec2 at = ivec2(row + r - 1, column + s - 1);
                const ivec2 nearest = clamp(at, ivec2(0), ivec2(dims.height, dims.width) - 1);
                if (dims.replicate == 0 && at != nearest) continue;
                const int near = int(pixel) + (nearest.x - row) * int(dims.width) + nearest.y - column;
                const float factor = x[((c / 4) * pixels + uint(near)) * 4 + c % 4];
                [[unroll]] for (uint lane = 0; lane < 4; ++lane)
                    if (lane < outputs)
                        sum[lane] += weight[((first + lane) * dims.in_channels + c) * 9 + uint(3 * r + s)] * factor;
            }
        value += sum;
    }
    if (dims.has_bias != 0)
        for (uint lane = 0; lane < outputs; ++lane) value[lane] += bias[first + lane];
    if (dims.has_residual != 0) value += residual[i];
    y[i] = value * dims.scale;
}
