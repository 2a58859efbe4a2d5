#version 460
// product[slice][p][k][c] = sum over the tiles of the slice, or of its part, of grad[p][k] * input[p][c], for each
// of the places p of a tile: register tiles in which an invocation holds kQuads quads of input channels and
// multiplies them, through constant shuffles, by kOut = kSums / kQuads output channels. Eight lanes hold kOut / 4
// quads of these, at kSpan consecutive tiles: two quads of input channels halve the shuffles.
// One subgroup of 8 lanes computes 32 kQuads input by kOut output channels at one place. Workgroups: input
// channels, output channels, places of every part of the sum, which makes a product of its own.
// Bindings: input [places][ceil(C/8)][stride] and grad [places][ceil(K/8)][stride], pairs of quads that are
// zero from dims.tiles to the next multiple of 8; product [slices][places][K][ceil(C/4)] vec4.
// Specialisation: workgroup size (a multiple of 8), kQuads: 1 or 2.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kWinogradQuadsId) const uint kQuads = 2;
QUADS(0, transformed);
QUADS(1, grad);
QUADS_OUT(2, product);
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

const uint kSums = 32;  // quads
const uint kOut = kSums / kQuads;
const uint kOutQuads = kOut / 4;
const uint kSpan = 8 / kOutQuads;
const uint kDepth = 4;  // tiles per loop turn

void main() {
    const uint in_quads = (dims.in_channels + 3) / 4;
    const uint in_octets = (dims.in_channels + 7) / 8;
    const uint out_quads = (dims.out_channels + 3) / 4;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint place = gl_WorkGroupID.z % dims.places;
    const uint part = gl_WorkGroupID.z / dims.places;
    const uint first_tile = part * dims.part_tiles;
    const uint tiles = min(dims.tiles, first_tile + dims.part_tiles);
    const uint in_quad = (gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x) * kQuads;
    const uint first_out = gl_WorkGroupID.y * kOut;
    // Quads beyond the edge are computed from others and not stored: all lanes must take part in the
    // shuffles.
    const uint from = min(in_quad, (in_quads - 1) / kQuads * kQuads);
    const uint grad_from = min(first_out / 4 + lane % kOutQuads, out_quads - 1);
    uint at = ((place * in_octets + from / 2) * dims.stride + first_tile) * 2 + from % 2;
    uint grad_at = ((place * ((dims.out_channels + 7) / 8) + grad_from / 2) * dims.stride + first_tile) * 2 +
                   grad_from % 2 + 2 * (lane / kOutQuads);

    vec4 sums[kSums];  // [output channel][quad]
    [[unroll]] for (uint o = 0; o < kSums; ++o) sums[o] = vec4(0);
    for (uint t = first_tile; t < tiles; t += kDepth) {
        vec4 v[kDepth * kQuads];  // [tile][quad]
        vec4 g[kDepth / kSpan];
        [[unroll]] for (uint u = 0; u < kDepth; ++u)
            [[unroll]] for (uint q = 0; q < kQuads; ++q) v[u * kQuads + q] = LD4(transformed, at + 2 * u + q);
        [[unroll]] for (uint u = 0; u < kDepth; u += kSpan) g[u / kSpan] = LD4(grad, grad_at + 2 * u);
        [[unroll]] for (uint o = 0; o < kOut; ++o) {
            float w[kDepth];
            [[unroll]] for (uint u = 0; u < kDepth; ++u)
                w[u] = subgroupShuffle(g[u / kSpan][o % 4], u % kSpan * kOutQuads + o / 4);
            [[unroll]] for (uint q = 0; q < kQuads; ++q)
                sums[o * kQuads + q] += (w[0] * v[q] + w[1] * v[kQuads + q]) +
                                        (w[2] * v[2 * kQuads + q] + w[3] * v[3 * kQuads + q]);
        }
        at += 2 * kDepth;
        grad_at += 2 * kDepth;
    }

    const uint to = (((dims.slice + part) * dims.places + place) * dims.out_channels + first_out) * in_quads + in_quad;
    [[unroll]] for (uint q = 0; q < kQuads; ++q) {
        if (in_quad + q >= in_quads) continue;
        [[unroll]] for (uint o = 0; o < kOut; ++o)
            if (first_out + o < dims.out_channels) ST4(product, to + o * in_quads + q, sums[o * kQuads + q] * dims.one);
    }
}
