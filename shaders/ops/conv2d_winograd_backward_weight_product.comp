#version 460
// product[slice][p][k][c] = sum over the tiles of the slice of grad[p][k] * input[p][c], for each of the places
// p of a tile: register tiles as in linear_backward_weight_fast.comp, lane l of every 8 with one quad of input
// channels and one of the 8 quads of output channels that constant shuffles broadcast.
// One subgroup of 8 lanes computes 32 by 32 channels at one place. Workgroups: input channels, output
// channels, places.
// Bindings: input [places][ceil(C/8)][stride] and grad [places][ceil(K/8)][stride], pairs of quads that are
// zero from dims.tiles to the next multiple of 8; product [slices][places][K][ceil(C/4)] vec4.
// Specialisation: 0 workgroup size (a multiple of 8).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"

layout(local_size_x_id = 0) in;
QUADS(0, transformed);
QUADS(1, grad);
QUADS_OUT(2, product);
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

const uint kDepth = 4;  // tiles per loop turn

void main() {
    const uint in_quads = (dims.in_channels + 3) / 4;
    const uint out_quads = (dims.out_channels + 3) / 4;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint in_quad = (gl_WorkGroupID.x * (gl_WorkGroupSize.x / 8) + gl_LocalInvocationID.x / 8) * 8 + lane;
    const uint out_quad = gl_WorkGroupID.y * 8;
    const uint place = gl_WorkGroupID.z;
    // Quads beyond the edge are computed from the last one and not stored: all lanes must take part
    // in the shuffles.
    const uint from = min(in_quad, in_quads - 1);
    const uint grad_from = min(out_quad + lane, out_quads - 1);
    uint at = (place * ((dims.in_channels + 7) / 8) + from / 2) * dims.stride * 2 + from % 2;
    uint grad_at = (place * ((dims.out_channels + 7) / 8) + grad_from / 2) * dims.stride * 2 + grad_from % 2;

    vec4 sums[32];
    [[unroll]] for (uint o = 0; o < 32; ++o) sums[o] = vec4(0);
    for (uint t = 0; t < dims.tiles; t += kDepth) {
        vec4 v[kDepth];
        vec4 g[kDepth];
        [[unroll]] for (uint u = 0; u < kDepth; ++u) {
            v[u] = LD4(transformed, at + 2 * u);
            g[u] = LD4(grad, grad_at + 2 * u);
        }
        [[unroll]] for (uint m = 0; m < 8; ++m)
            [[unroll]] for (uint c = 0; c < 4; ++c)
                sums[4 * m + c] += (subgroupShuffle(g[0][c], m) * v[0] + subgroupShuffle(g[1][c], m) * v[1]) +
                                   (subgroupShuffle(g[2][c], m) * v[2] + subgroupShuffle(g[3][c], m) * v[3]);
        at += 2 * kDepth;
        grad_at += 2 * kDepth;
    }

    if (in_quad >= in_quads) return;
    const uint to = ((dims.slice * dims.places + place) * dims.out_channels + 4 * out_quad) * in_quads + in_quad;
    [[unroll]] for (uint o = 0; o < 32; ++o)
        if (4 * out_quad + o < dims.out_channels) ST4(product, to + o * in_quads, sums[o]);
}
