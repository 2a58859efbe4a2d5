#version 460
// U = G w G^T for every pair of channels, in the order in which conv2d_winograd_forward_product.comp reads:
//   transformed[p][b][q][m] = U[p] of output channel 8b+m and input channels 4q..4q+3, zero beyond the edges;
// w[m][k] = weight[m][k] or, when transposed, weight[k][m] with its taps in reverse order.
// One invocation transforms four pairs.
// Bindings: weight row-major (read as words), transformed [kSize^2][ceil(K/8)][2*ceil(C/8)][8] vec4.
// Specialisation: 0 workgroup size, 10 kTile.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"
#include "winograd.glsl"

layout(local_size_x_id = 0) in;
UINTS(0, weight);
QUADS_OUT(1, transformed);
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#include "launch.glsl"

void main() {
    const uint quads = (dims.in_channels + 7) / 8 * 2;
    const uint blocks = (dims.out_channels + 7) / 8;
    const uint i = invocation_index(dims.groups_x);
    if (i >= blocks * quads * 8) return;
    const uint m = i / (8 * quads) * 8 + i % 8;
    const uint quad = i / 8 % quads;

    vec4 values[kRow * kRow];
    [[unroll]] for (uint lane = 0; lane < 4; ++lane) {
        const uint k = 4 * quad + lane;
        const bool inside = m < dims.out_channels && k < dims.in_channels;
        const uint pair = dims.transposed != 0 ? k * dims.out_channels + m : m * dims.in_channels + k;
        [[unroll]] for (uint tap = 0; tap < 9; ++tap) {
            const uint at = inside ? 9 * pair + (dims.transposed != 0 ? 8 - tap : tap) : 0;
            const float value = uintBitsToFloat(LD1(weight, at));
            values[tap / 3 * kRow + tap % 3][lane] = inside ? value : 0;
        }
    }
    [[unroll]] for (uint s = 0; s < 3; ++s) apply_g(COLUMN_OF(values, s));
    [[unroll]] for (uint r = 0; r < kSize; ++r) {
        apply_g(ROW_OF(values, r));
        [[unroll]] for (uint s = 0; s < kSize; ++s)
            ST4(transformed, (r * kSize + s) * blocks * quads * 8 + i, values[r * kRow + s]);
    }
}
