#version 460
// partial[s][r] = grad_y^T x over the pixels of slice s, x shifted by tap r, as register tiles like those of
// linear_backward_weight_cpu.comp. Each row of pixels is summed, then the rows, as in conv2d_backward_weight.comp;
// conv2d_backward_weight_reduce.comp sums the slices.
// One subgroup of 8 lanes computes 32 input by 4 kOutQuads output channels of one tap and slice. Workgroups: input
// channels, output channels, 9 * slice + tap.
// Bindings: x quads [C/4][N*H*W], grad_y quads [K/4][N*H*W], partial [slices][9][K][ceil(C/4)] vec4.
// Specialisation: workgroup size, kOutQuads, up to 8.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kConv2dOutQuadsId) const uint kOutQuads = 8;
QUADS(0, x);
QUADS(1, grad_y);
QUADS_OUT(2, partial);
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "conv2d_slices.glsl"

const uint kDepth = 4;  // pixels per loop turn

void main() {
    const uint in_quads = (dims.in_channels + 3) / 4;
    const uint out_quads = (dims.out_channels + 3) / 4;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint in_quad = gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    const uint out_quad = gl_WorkGroupID.y * kOutQuads;
    const uint slice = gl_WorkGroupID.z / 9;
    const uint tap = gl_WorkGroupID.z % 9;
    const int down = int(tap / 3) - 1;
    const int right = int(tap % 3) - 1;
    const int width = int(dims.width);
    // Quads beyond the edge are computed from the last one and not stored: all lanes must take part
    // in the shuffles.
    const int pixels = int(dims.n * dims.height) * width;
    const int x_at = int(min(in_quad, in_quads - 1)) * pixels + down * width + right;
    const int grad_at = int(min(out_quad + lane, out_quads - 1)) * pixels;
    const int begin = max(0, -right);
    const int end = width - max(0, right);

    vec4 totals[4 * kOutQuads];
    [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o) totals[o] = vec4(0);
    for (uint row = slice_begin(slice); row < slice_end(slice); ++row) {
        const uint near_row = uint(int(row % dims.height) + down);
        if (near_row >= dims.height) continue;
        vec4 sums[4 * kOutQuads];
        [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o) sums[o] = vec4(0);
        for (int column = begin; column < end; column += int(kDepth)) {
            vec4 v[kDepth];
            vec4 g[kDepth];
            [[unroll]] for (uint u = 0; u < kDepth; ++u) {
                const int pixel = int(row) * width + min(column + int(u), end - 1);
                const vec4 value = LD4(x, x_at + pixel);
                v[u] = column + int(u) < end ? value : vec4(0);
                g[u] = LD4(grad_y, grad_at + pixel);
            }
            [[unroll]] for (uint m = 0; m < kOutQuads; ++m)
                [[unroll]] for (uint c = 0; c < 4; ++c)
                    sums[4 * m + c] += (subgroupShuffle(g[0][c], m) * v[0] + subgroupShuffle(g[1][c], m) * v[1]) +
                                       (subgroupShuffle(g[2][c], m) * v[2] + subgroupShuffle(g[3][c], m) * v[3]);
        }
        [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o) totals[o] += sums[o];
    }

    if (in_quad >= in_quads) return;
    const uint to = ((slice * 9 + tap) * dims.out_channels + 4 * out_quad) * in_quads + in_quad;
    [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o)
        if (4 * out_quad + o < dims.out_channels) ST4(partial, to + o * in_quads, totals[o]);
}
