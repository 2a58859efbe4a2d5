#version 460
// y = (x W^T + bias + residual) * scale as a product of register tiles: the lanes of a subgroup run
// along the rows of x (the columns of the quad layout), and lane l of every 8 also fetches row l of a
// block of 8 output features, which constant shuffles then broadcast. Four products are summed before they are added
// to the accumulator: faster, and with the error of a sum of K/4 terms.
// One invocation computes kColumns rows of x by 8 * kBlocks output features; subgroups of 8 lanes
// or more. Workgroups: output features (next to each other in time, so that the rows stay in the cache), rows (y, z).
// Bindings: x quads [in/4][rows], weight from linear_pack_weight.comp, bias [out] (read as quads),
// residual and y quads [out/4][rows].
// Specialisation: workgroup size (a multiple of 8), kColumns, kBlocks, kResidual: there is a residual (lavapipe
// would load it even under a condition), kDepth: quads of k per turn of the loop, 1 or 2.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kLinearColumnsId) const uint kColumns = 4;
layout(constant_id = kLinearBlocksId) const uint kBlocks = 4;
layout(constant_id = kLinearResidualId) const uint kResidual = 1;
layout(constant_id = kLinearDepthId) const uint kDepth = 1;
QUADS(0, x);
QUADS(1, weight);
QUADS(2, bias);
QUADS(3, residual);
QUADS_OUT(4, y);
layout(push_constant) uniform Push { LinearParams dims; };

void main() {
    const uint quads = (dims.in_features + 3) / 4;
    const uint padded_quads = (quads + 1) / 2 * 2;  // quads of a packed weight
    const uint out_quads = (dims.out_features + 3) / 4;
    const uint row_group = gl_WorkGroupID.z * dims.groups_x + gl_WorkGroupID.y;
    const uint first_row = row_group * gl_WorkGroupSize.x * kColumns + gl_LocalInvocationID.x;
    const uint first_block = gl_WorkGroupID.x * kBlocks;
    const uint lane = gl_SubgroupInvocationID & 7u;
    uint packed_rows[kBlocks];  // blocks beyond the last repeat it and are not stored
    [[unroll]] for (uint b = 0; b < kBlocks; ++b)
        packed_rows[b] = min(first_block + b, (dims.out_features - 1) / 8) * padded_quads * 8 + lane;

    float sums[kBlocks * 8 * kColumns];  // [block][feature of 8][column]
    [[unroll]] for (uint i = 0; i < kBlocks * 8 * kColumns; ++i) sums[i] = 0;
    // Lanes beyond the last row recompute it and store nothing: all must take part in the shuffles.
    uint row[kColumns];
    [[unroll]] for (uint a = 0; a < kColumns; ++a)
        row[a] = min(first_row + a * gl_WorkGroupSize.x, dims.rows - 1);

    uint q = 0;
    do {
        vec4 v[kDepth * kColumns];
        [[unroll]] for (uint u = 0; u < kDepth; ++u)
            [[unroll]] for (uint a = 0; a < kColumns; ++a)  // the weights of an extra quad are zero
                v[u * kColumns + a] = LD4(x, min(q + u, quads - 1) * dims.rows + row[a]);
        [[unroll]] for (uint b = 0; b < kBlocks; ++b) {
            vec4 w[kDepth];
            [[unroll]] for (uint u = 0; u < kDepth; ++u)
                w[u] = LD4(weight, packed_rows[b] + (q + u) * 8);
            [[unroll]] for (uint m = 0; m < 8; ++m)
                [[unroll]] for (uint u = 0; u < kDepth; ++u) {
                    const float w0 = subgroupShuffle(w[u].x, m);
                    const float w1 = subgroupShuffle(w[u].y, m);
                    const float w2 = subgroupShuffle(w[u].z, m);
                    const float w3 = subgroupShuffle(w[u].w, m);
                    [[unroll]] for (uint a = 0; a < kColumns; ++a) {
                        const vec4 k = v[u * kColumns + a];
                        sums[(b * 8 + m) * kColumns + a] +=
                            (w0 * k.x + w1 * k.y) + (w2 * k.z + w3 * k.w);
                    }
                }
        }
        q += kDepth;
    } while (q < quads);

    [[unroll]] for (uint half_block = 0; half_block < 2 * kBlocks; ++half_block) {
        const uint quad = 2 * first_block + half_block;
        if (quad >= out_quads) break;
        // Beyond out_features the weights are zero, but the memory after the bias may hold anything.
        const bvec4 inside = lessThan(4 * quad + uvec4(0, 1, 2, 3), uvec4(dims.out_features));
        const vec4 shift = dims.has_bias != 0 ? mix(vec4(0), LD4(bias, quad), inside) : vec4(0);
        [[unroll]] for (uint a = 0; a < kColumns; ++a) {
            const uint r = first_row + a * gl_WorkGroupSize.x;
            const uint at = half_block * 4 * kColumns + a;
            if (r >= dims.rows) continue;
            vec4 value = vec4(sums[at], sums[at + kColumns], sums[at + 2 * kColumns], sums[at + 3 * kColumns]) + shift;
            if (kResidual != 0) value += LD4(residual, quad * dims.rows + r);
            ST4(y, quad * dims.rows + r, value * dims.scale);
        }
    }
}
