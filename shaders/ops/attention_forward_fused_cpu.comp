#version 460
// Attention of each image and head in one pass over its keys, without a matrix of scores: for 8 * kBlocks keys at a
// time the scores s[k][n] = scale * sum_c keys[c][k] queries[c][n], their exponentials by the greatest score so far,
// and the products with the values, to which earlier sums are scaled:
//   y[c][n] = sum_k exp(s[k][n] - max) values[c][k] / sum_k exp(s[k][n] - max)
// The lanes run along the queries; lane l of every 8 also fetches row l of 8 keys or channels, which constant shuffles
// then broadcast, as in attention_product_cpu.comp.
// One invocation computes kColumns queries; subgroups of 8 lanes or more.
// Bindings: queries, keys, values transposed [k/4][c], y.
// Specialisation: workgroup size (a multiple of 8), kColumns, kBlocks, kQuads (of channels), kDepth (divides kQuads).
// Source: the running maximum is that of Milakov and Gimelshein 2018, arXiv:1805.02867, algorithm 3.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kAttentionColumnsId) const uint kColumns = 4;
layout(constant_id = kAttentionBlocksId) const uint kBlocks = 2;
layout(constant_id = kAttentionQuadsId) const uint kQuads = 16;
layout(constant_id = kAttentionDepthId) const uint kDepth = 4;
QUADS(0, queries);
QUADS(1, keys);
QUADS(2, values);
QUADS_OUT(3, y);
layout(push_constant) uniform Push { AttentionParams params; };

#include "channels.glsl"

const float kLowest = -3.402823466e38;
const uint kOctets = (kQuads + 1) / 2;
const uint kKeys = 8 * kBlocks;

float scores[kKeys * kColumns];      // [key][column], then their exponentials
float sums[8 * kOctets * kColumns];  // [channel][column]
float tops[kColumns], totals[kColumns];
float kept[kColumns];  // what the new maximum leaves of earlier sums
uint columns[kColumns];

void compute_scores(uint first, uint lane) {
    [[unroll]] for (uint i = 0; i < kKeys * kColumns; ++i) scores[i] = 0;
    uint rows[kBlocks];
    [[unroll]] for (uint b = 0; b < kBlocks; ++b)
        rows[b] = params.s_from + gl_WorkGroupID.z * params.s_head + min(first + 8 * b + lane, params.k - 1);
    uint q = 0;
    do {
        vec4 vs[kDepth * kColumns];
        [[unroll]] for (uint u = 0; u < kDepth; ++u)
            [[unroll]] for (uint a = 0; a < kColumns; ++a)
                vs[u * kColumns + a] = LD4(queries, (q + u) * params.v_stride + columns[a]);
        [[unroll]] for (uint b = 0; b < kBlocks; ++b) {
            vec4 w[kDepth];
            [[unroll]] for (uint u = 0; u < kDepth; ++u) w[u] = LD4(keys, (q + u) * params.s_stride + rows[b]);
            [[unroll]] for (uint m = 0; m < 8; ++m)
                [[unroll]] for (uint u = 0; u < kDepth; ++u) {
                    const float w0 = subgroupShuffle(w[u].x, m), w1 = subgroupShuffle(w[u].y, m);
                    const float w2 = subgroupShuffle(w[u].z, m), w3 = subgroupShuffle(w[u].w, m);
                    [[unroll]] for (uint a = 0; a < kColumns; ++a) {
                        const vec4 v = vs[u * kColumns + a];
                        scores[(b * 8 + m) * kColumns + a] += (w0 * v.x + w1 * v.y) + (w2 * v.z + w3 * v.w);
                    }
                }
        }
        q += kDepth;
    } while (q < kQuads);
}

void compute_exponentials(uint first) {
    [[unroll]] for (uint a = 0; a < kColumns; ++a) {
        float top = tops[a];
        [[unroll]] for (uint j = 0; j < kKeys; ++j) {
            const uint at = j * kColumns + a;
            scores[at] = first + j < params.k ? params.scale * scores[at] : kLowest;
            top = max(top, scores[at]);
        }
        kept[a] = exp(tops[a] - top);
        tops[a] = top;
        float total = 0;
        [[unroll]] for (uint j = 0; j < kKeys; ++j) {
            const uint at = j * kColumns + a;
            scores[at] = first + j < params.k ? exp(scores[at] - top) : 0;
            total += scores[at];
        }
        totals[a] = totals[a] * kept[a] + total;
    }
}

void add_values(uint first, uint lane) {
    const uint quads = (params.k + 3) / 4;
    uint rows[2 * kBlocks];
    [[unroll]] for (uint u = 0; u < 2 * kBlocks; ++u)
        rows[u] = (gl_WorkGroupID.z * quads + min(first / 4 + u, quads - 1)) * params.m;
    [[unroll]] for (uint b = 0; b < kOctets; ++b) {
        vec4 w[2 * kBlocks];
        [[unroll]] for (uint u = 0; u < 2 * kBlocks; ++u)
            w[u] = LD4(values, rows[u] + min(8 * b + lane, params.m - 1));
        [[unroll]] for (uint m = 0; m < 8; ++m) {
            const uint to = (b * 8 + m) * kColumns;
            float sum[kColumns];  // stays in registers, which hold only some of the sums
            [[unroll]] for (uint a = 0; a < kColumns; ++a) sum[a] = sums[to + a] * kept[a];
            [[unroll]] for (uint u = 0; u < 2 * kBlocks; ++u) {
                const float w0 = subgroupShuffle(w[u].x, m), w1 = subgroupShuffle(w[u].y, m);
                const float w2 = subgroupShuffle(w[u].z, m), w3 = subgroupShuffle(w[u].w, m);
                [[unroll]] for (uint a = 0; a < kColumns; ++a) {
                    const uint at = 4 * u * kColumns + a;
                    sum[a] += (w0 * scores[at] + w1 * scores[at + kColumns]) +
                              (w2 * scores[at + 2 * kColumns] + w3 * scores[at + 3 * kColumns]);
                }
            }
            [[unroll]] for (uint a = 0; a < kColumns; ++a) sums[to + a] = sum[a];
        }
    }
}

void main() {
    const uint first_column = gl_WorkGroupID.x * gl_WorkGroupSize.x * kColumns + gl_LocalInvocationID.x;
    const uint lane = gl_SubgroupInvocationID & 7u;
    [[unroll]] for (uint i = 0; i < 8 * kOctets * kColumns; ++i) sums[i] = 0;
    // Lanes beyond the edge recompute the last query and store nothing: all must take part in the shuffles.
    [[unroll]] for (uint a = 0; a < kColumns; ++a) {
        columns[a] = params.v_from + gl_WorkGroupID.z * params.v_head +
                     min(first_column + a * gl_WorkGroupSize.x, params.n - 1);
        tops[a] = kLowest;
        totals[a] = 0;
    }
    uint first = 0;
    do {
        compute_scores(first, lane);
        compute_exponentials(first);
        add_values(first, lane);
        first += kKeys;
    } while (first < params.k);
    const uint to = params.y_from + gl_WorkGroupID.z * params.y_head;
    [[unroll]] for (uint a = 0; a < kColumns; ++a) {
        const uint r = first_column + a * gl_WorkGroupSize.x;
        const float factor = 1.0 / totals[a];
        [[unroll]] for (uint quad = 0; quad < kQuads; ++quad) {
            const uint at = 4 * quad * kColumns + a;
            const vec4 value = vec4(sums[at], sums[at + kColumns], sums[at + 2 * kColumns], sums[at + 3 * kColumns]);
            if (r < params.n)
                ST4(y, to + quad * params.y_stride + r, factor * channels_below(value, 4 * quad, params.m));
        }
    }
}
