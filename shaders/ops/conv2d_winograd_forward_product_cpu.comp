#version 460
// product[p] = weight[p] transformed[p] for each of the kSize^2 places p of a tile: register tiles as in
// linear_forward_cpu.comp, the lanes along the tiles of the slice.
// One invocation computes kColumns tiles by 8 * kBlocks output channels at one place; subgroups of 8 lanes
// or more. Workgroups: tiles (a whole number of workgroups, so that nothing is guarded), output channels,
// places.
// Bindings: transformed [places][ceil(C/8)][stride] pairs of quads, weight from
// conv2d_winograd_forward_weight.comp, product [places][ceil(K/8)][stride] pairs of quads.
// Specialisation: workgroup size (a multiple of 8), kColumns, kBlocks, kDepth: quads of channels per turn of the
// loop, 1 or 2.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kWinogradColumnsId) const uint kColumns = 4;
layout(constant_id = kWinogradBlocksId) const uint kBlocks = 4;
layout(constant_id = kWinogradDepthId) const uint kDepth = 1;
QUADS(0, transformed);
QUADS(1, weight);
OCTETS_OUT(2, product);
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

void main() {
    const uint octets = (dims.in_channels + 7) / 8;
    const uint blocks = (dims.out_channels + 7) / 8;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint column = gl_WorkGroupID.x * gl_WorkGroupSize.x * kColumns + gl_LocalInvocationID.x;
    const uint place = gl_WorkGroupID.z;

    float sums[kBlocks * 8 * kColumns];  // [block][channel of 8][column]
    [[unroll]] for (uint i = 0; i < kBlocks * 8 * kColumns; ++i) sums[i] = 0;
    uint rows[kBlocks];  // blocks beyond the last repeat it and are not stored
    [[unroll]] for (uint b = 0; b < kBlocks; ++b)
        rows[b] = (place * blocks + min(gl_WorkGroupID.y * kBlocks + b, blocks - 1)) * octets * 16 + lane;
    uint at = (place * octets * dims.stride + column) * 2;

    uint quad = 0;
    do {
        vec4 v[kDepth * kColumns];
        [[unroll]] for (uint d = 0; d < kDepth; ++d)
            [[unroll]] for (uint a = 0; a < kColumns; ++a)
                v[d * kColumns + a] = LD4(transformed, at + d + 2 * a * gl_WorkGroupSize.x);
        [[unroll]] for (uint b = 0; b < kBlocks; ++b) {
            vec4 w[kDepth];
            [[unroll]] for (uint d = 0; d < kDepth; ++d) w[d] = LD4(weight, rows[b] + (quad + d) * 8);
            [[unroll]] for (uint m = 0; m < 8; ++m) {
                vec4 u[kDepth];
                [[unroll]] for (uint d = 0; d < kDepth; ++d)
                    u[d] = vec4(subgroupShuffle(w[d].x, m), subgroupShuffle(w[d].y, m), subgroupShuffle(w[d].z, m),
                                subgroupShuffle(w[d].w, m));
                [[unroll]] for (uint a = 0; a < kColumns; ++a) {
                    const uint s = (b * 8 + m) * kColumns + a;
                    [[unroll]] for (uint d = 0; d < kDepth; ++d) {
                        const vec4 k = v[d * kColumns + a];
                        sums[s] += (u[d].x * k.x + u[d].y * k.y) + (u[d].z * k.z + u[d].w * k.w);
                    }
                }
            }
        }
        at += kDepth == 2 ? 2 * dims.stride : (quad & 1u) == 0 ? 1 : 2 * dims.stride - 1;
        quad += kDepth;
    } while (quad < 2 * octets);

    [[unroll]] for (uint i = 0; i < kBlocks * 8 * kColumns; ++i) sums[i] *= dims.one;  // see store.glsl
    [[unroll]] for (uint b = 0; b < kBlocks; ++b) {
        const uint block = gl_WorkGroupID.y * kBlocks + b;
        if (block >= blocks) break;
        [[unroll]] for (uint a = 0; a < kColumns; ++a) {
            const uint s = b * 8 * kColumns + a;
            ST8_ALL(product, (place * blocks + block) * dims.stride + column + a * gl_WorkGroupSize.x,
                vec4(sums[s], sums[s + kColumns], sums[s + 2 * kColumns], sums[s + 3 * kColumns]),
                vec4(sums[s + 4 * kColumns], sums[s + 5 * kColumns], sums[s + 6 * kColumns], sums[s + 7 * kColumns]));
        }
    }
}
