#version 460
// partial[s] = grad_y^T x over the rows of slice s, as register tiles: an invocation holds one quad of input
// features, and lane l of every 8 one of output features, four of the factors that constant shuffles
// broadcast; an invocation may be any lane. Rows are summed in blocks of 64, then the blocks, as in
// linear_backward_weight.comp; linear_backward_weight_reduce.comp sums the slices.
// One subgroup of 8 lanes computes 4 kOutQuads by 32 weights of one slice.
// Bindings: x quads [in/4][rows], grad_y quads [out/4][rows], partial [slices][out][in/4] vec4.
// Specialisation: workgroup size, kOutQuads, up to 8.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kLinearOutQuadsId) const uint kOutQuads = 8;
QUADS(0, x);
QUADS(1, grad_y);
QUADS_OUT(2, partial);
layout(push_constant) uniform Push { LinearParams dims; };

#include "linear_slices.glsl"

const uint kDepth = 4;  // rows per loop turn

void main() {
    const uint in_quads = (dims.in_features + 3) / 4;
    const uint out_quads = (dims.out_features + 3) / 4;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint in_quad = gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    const uint out_quad = gl_WorkGroupID.y * kOutQuads;
    // Quads beyond the edge are computed from the last one and not stored: all lanes must take part
    // in the shuffles.
    const uint x_at = min(in_quad, in_quads - 1) * dims.rows;
    const uint grad_at = min(out_quad + lane, out_quads - 1) * dims.rows;

    const uint begin = slice_begin(gl_WorkGroupID.z);
    const uint end = slice_end(gl_WorkGroupID.z);

    vec4 totals[4 * kOutQuads];
    [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o) totals[o] = vec4(0);
    for (uint first = begin; first < end; first += kBlock) {
        const uint last = min(first + kBlock, end);
        vec4 sums[4 * kOutQuads];
        [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o) sums[o] = vec4(0);
        for (uint r = first; r < last; r += kDepth) {
            vec4 v[kDepth];
            vec4 g[kDepth];
            // First one operand, then the other: lanes are a power of two bytes apart, so that the lines of both
            // together would not fit one set of the cache.
            [[unroll]] for (uint u = 0; u < kDepth; ++u) {
                const vec4 value = LD4(x, x_at + min(r + u, last - 1));
                v[u] = r + u < last ? value : vec4(0);
            }
            [[unroll]] for (uint u = 0; u < kDepth; ++u) g[u] = LD4(grad_y, grad_at + min(r + u, last - 1));
            [[unroll]] for (uint m = 0; m < kOutQuads; ++m)
                [[unroll]] for (uint c = 0; c < 4; ++c)
                    sums[4 * m + c] += (subgroupShuffle(g[0][c], m) * v[0] + subgroupShuffle(g[1][c], m) * v[1]) +
                                       (subgroupShuffle(g[2][c], m) * v[2] + subgroupShuffle(g[3][c], m) * v[3]);
        }
        [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o) totals[o] += sums[o];
    }

    if (in_quad >= in_quads) return;
    const uint at = (gl_WorkGroupID.z * dims.out_features + 4 * out_quad) * in_quads + in_quad;
    [[unroll]] for (uint o = 0; o < 4 * kOutQuads; ++o)
        if (4 * out_quad + o < dims.out_features) ST4(partial, at + o * in_quads, totals[o]);
}
