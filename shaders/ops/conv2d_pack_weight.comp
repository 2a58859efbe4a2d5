#version 460
// Weights in the order in which conv2d_forward_fast.comp reads them:
//   packed[b][q][r][m] = (w[8b+m][4q][r], ..., w[8b+m][4q+3][r]) of tap r, zero beyond the edges;
// w[m][k] = weight[m][k] or, when transposed, weight[k][m] with its taps in reverse order. in_channels and
// out_channels are those of w. One invocation writes one quad.
// Bindings: weight row-major, packed [ceil(K/8)][ceil(C/4)][9][8] vec4.
#extension GL_GOOGLE_include_directive : require
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Packed { vec4 packed[]; };
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint quads = (dims.in_channels + 3) / 4;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.out_channels + 7) / 8 * quads * 72) return;
    const uint m = i / (72 * quads) * 8 + i % 8;
    const uint tap = i / 8 % 9;
    const uint quad = i / 72 % quads;
    vec4 value = vec4(0);
    if (m < dims.out_channels)
        for (uint lane = 0; lane < 4 && 4 * quad + lane < dims.in_channels; ++lane) {
            const uint k = 4 * quad + lane;
            value[lane] = dims.transposed != 0 ? weight[(k * dims.out_channels + m) * 9 + 8 - tap]
                                               : weight[(m * dims.in_channels + k) * 9 + tap];
        }
    packed[i] = value;
}
