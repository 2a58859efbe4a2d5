#version 460
// Like attention_product.comp, in the register tiles of linear_forward_cpu.comp: the lanes run along the
// columns, and lane l of every 8 also fetches row l of a block of 8 rows, which constant shuffles then
// broadcast. Both operands have the layout of the tile, so nothing is packed.
// One invocation computes kColumns columns by 8 * kBlocks rows; subgroups of 8 lanes or more.
// Bindings: s, v, other, y.
// Specialisation: workgroup size (a multiple of 8), kColumns, kBlocks, kOther.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kAttentionColumnsId) const uint kColumns = 8;
layout(constant_id = kAttentionBlocksId) const uint kBlocks = 2;
layout(constant_id = kAttentionOtherId) const uint kOther = 0;
QUADS(0, s);
QUADS(1, v);
QUADS(2, other);
QUADS_OUT(3, y);
layout(push_constant) uniform Push { AttentionParams params; };

#include "channels.glsl"

void main() {
    const uint quads = (params.k + 3) / 4;
    const uint first_column = gl_WorkGroupID.x * gl_WorkGroupSize.x * kColumns + gl_LocalInvocationID.x;
    const uint first_block = gl_WorkGroupID.y * kBlocks;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint image = gl_WorkGroupID.z / params.heads;
    const uint head = gl_WorkGroupID.z % params.heads;
    const uint from_s = params.s_from + image * params.s_image + head * params.s_head;
    const uint from_v = params.v_from + image * params.v_image + head * params.v_head;

    float sums[kBlocks * 8 * kColumns];  // [block][row of 8][column]
    [[unroll]] for (uint i = 0; i < kBlocks * 8 * kColumns; ++i) sums[i] = 0;
    // Lanes beyond the edges recompute the last row or column and store nothing: all must take part
    // in the shuffles.
    uint column[kColumns];
    [[unroll]] for (uint a = 0; a < kColumns; ++a)
        column[a] = from_v + min(first_column + a * gl_WorkGroupSize.x, params.n - 1);
    uint row[kBlocks];
    [[unroll]] for (uint b = 0; b < kBlocks; ++b)
        row[b] = from_s + min((first_block + b) * 8 + lane, params.m - 1);

    for (uint q = 0; q < quads; ++q) {
        vec4 vs[kColumns];
        [[unroll]] for (uint a = 0; a < kColumns; ++a) vs[a] = LD4(v, q * params.v_stride + column[a]);
        [[unroll]] for (uint b = 0; b < kBlocks; ++b) {
            const vec4 w = LD4(s, q * params.s_stride + row[b]);
            [[unroll]] for (uint m = 0; m < 8; ++m) {
                const float w0 = subgroupShuffle(w.x, m);
                const float w1 = subgroupShuffle(w.y, m);
                const float w2 = subgroupShuffle(w.z, m);
                const float w3 = subgroupShuffle(w.w, m);
                [[unroll]] for (uint a = 0; a < kColumns; ++a) {
                    const vec4 k = vs[a];
                    sums[(b * 8 + m) * kColumns + a] += (w0 * k.x + w1 * k.y) + (w2 * k.z + w3 * k.w);
                }
            }
        }
    }

    const uint to = params.y_from + image * params.y_image + head * params.y_head;
    [[unroll]] for (uint half_block = 0; half_block < 2 * kBlocks; ++half_block) {
        const uint quad = 2 * first_block + half_block;
        if (4 * quad >= params.m) break;
        [[unroll]] for (uint a = 0; a < kColumns; ++a) {
            const uint r = first_column + a * gl_WorkGroupSize.x;
            const uint at = half_block * 4 * kColumns + a;
            vec4 value = vec4(sums[at], sums[at + kColumns], sums[at + 2 * kColumns], sums[at + 3 * kColumns]);
            value = params.scale * channels_below(value, 4 * quad, params.m);
            if (r < params.n) {
                if (kOther == kAttentionAddsOther) value += LD4(other, to + quad * params.y_stride + r);
                if (kOther == kAttentionTimesOther) value *= LD4(other, gl_WorkGroupID.z * params.n + r);
                ST4(y, to + quad * params.y_stride + r, value);
            }
        }
    }
}
