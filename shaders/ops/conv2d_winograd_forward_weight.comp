#version 460
// U = G w G^T for every pair of channels, in the order in which the kernels of conv2d_winograd_forward_product read:
//   transformed[p][b][q][m] = U[p] of output channel 8b+m and input channels 4q..4q+3, zero beyond the edges;
// w[m][k] = weight[m][k] or, when transposed, weight[k][m] with its taps in reverse order.
// One invocation transforms kPackedQuads quads of input channels for one output channel.
// Bindings: weight row-major (read as quads), transformed [kSize^2][ceil(K/8)][2*ceil(C/8)][8] vec4.
// Specialisation: workgroup size, kTile, kPackedQuads: longer runs of each place are faster on a CPU,
// kWhole: the taps of a quad of input channels are nine quads of the weight.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"
#include "winograd.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kWinogradPackedQuadsId) const uint kPackedQuads = 1;
layout(constant_id = kWinogradWholeId) const uint kWhole = 0;
QUADS(0, weight);
QUADS_OUT(1, transformed);
OCTETS_OUT(1, transformed_pairs);  // the same
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#include "launch.glsl"

void main() {
    const uint quads = (dims.in_channels + 7) / 8 * 2;
    const uint blocks = (dims.out_channels + 7) / 8;
    const uint runs = (quads + kPackedQuads - 1) / kPackedQuads;
    const uint i = invocation_index(dims.groups_x);
    if (i >= blocks * runs * 8) return;
    const uint block = i / (8 * runs);
    const uint m = 8 * block + i % 8;
    const uint last = (9 * dims.out_channels * dims.in_channels - 1) / 4;  // quad of the weight

    vec4 w[kPackedQuads * 9];
    uint at[kPackedQuads];  // a run beyond the last quad repeats it
    [[unroll]] for (uint q = 0; q < kPackedQuads; ++q) {
        const uint quad = min(i / 8 % runs * kPackedQuads + q, quads - 1);
        at[q] = (block * quads + quad) * 8 + i % 8;
        if (kWhole != 0) {
            const bool inside = m < dims.out_channels && 4 * quad < dims.in_channels;
            const uint first = inside ? 9 * (m * (dims.in_channels / 4) + quad) : 0;
            [[unroll]] for (uint j = 0; j < 9; ++j) {
                const vec4 four = LD4(weight, first + j);
                [[unroll]] for (uint n = 0; n < 4; ++n)
                    w[9 * q + (4 * j + n) % 9][(4 * j + n) / 9] = inside ? four[n] : 0;
            }
            continue;
        }
        [[unroll]] for (uint lane = 0; lane < 4; ++lane) {
            const uint k = 4 * quad + lane;
            const bool inside = m < dims.out_channels && k < dims.in_channels;
            const uint pair = dims.transposed != 0 ? k * dims.out_channels + m : m * dims.in_channels + k;
            const uint first = inside ? 9 * pair : 0;
            float taps[12];  // starts with the quad of the first tap, which then moves to the front
            [[unroll]] for (uint j = 0; j < 3; ++j) {
                const vec4 four = LD4(weight, min(first / 4 + j, last));
                [[unroll]] for (uint n = 0; n < 4; ++n) taps[4 * j + n] = four[n];
            }
            [[unroll]] for (uint t = 0; t < 10; ++t) taps[t] = (first & 2u) != 0 ? taps[t + 2] : taps[t];
            [[unroll]] for (uint t = 0; t < 9; ++t) taps[t] = (first & 1u) != 0 ? taps[t + 1] : taps[t];
            [[unroll]] for (uint t = 0; t < 9; ++t)
                w[9 * q + t][lane] = !inside ? 0 : dims.transposed != 0 ? taps[8 - t] : taps[t];
        }
    }
    for (uint r = 0; r < kSize; ++r) {
        [[unroll]] for (uint q = 0; q < kPackedQuads; ++q) {
            vec4 row[3];
            [[unroll]] for (uint s = 0; s < 3; ++s)
                row[s] = row_of_g(r, w[9 * q + s], w[9 * q + 3 + s], w[9 * q + 6 + s]);
            [[unroll]] for (uint s = 0; s < kSize; ++s)
                ST4_RUN(transformed, transformed_pairs, (r * kSize + s) * blocks * quads * 8 + at[q],
                    factor_of_g(r, s) * row_of_g(s, row[0], row[1], row[2]));
        }
    }
}
