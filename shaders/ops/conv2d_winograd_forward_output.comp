#version 460
// y = (A^T product A + bias + residual) * scale on every tile of a slice, cut where the image ends.
// One invocation computes one tile of 4 channels. Workgroups: tiles, quads of channels.
// Bindings: product [kSize^2][ceil(K/8)][stride] pairs of quads, bias [K] (read as quads), residual and y
// quads [K/4][N*H*W].
// Specialisation: workgroup size, kTile, kResidual: there is a residual (lavapipe would load it even under a
// condition), kExact: tiles cover the image exactly and come in eights, see ST8_ALL.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"
#include "winograd.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kWinogradResidualId) const uint kResidual = 1;
layout(constant_id = kWinogradExactId) const uint kExact = 0;
QUADS(0, product);
QUADS(1, bias);
QUADS(2, residual);
QUADS_OUT(3, y);
OCTETS_OUT(3, y_pairs);  // the same
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#include "winograd_tile.glsl"

void main() {
    const uint t = gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (t >= dims.tiles) return;
    const uint quad = gl_WorkGroupID.y;
    const uint octets = (dims.out_channels + 7) / 8;
    const Tile tile = tile_at(t);

    vec4 values[kRow * kRow];
    [[unroll]] for (uint i = 0; i < kSize; ++i) {
        [[unroll]] for (uint j = 0; j < kSize; ++j)
            values[j * kRow + i] =
                LD4(product, (((j * kSize + i) * octets + quad / 2) * dims.stride + t) * 2 + quad % 2);
        apply_at(COLUMN_OF(values, i));
    }
    // Beyond out_channels the product is zero, but the memory after the bias may hold anything.
    const bvec4 inside = lessThan(4 * quad + uvec4(0, 1, 2, 3), uvec4(dims.out_channels));
    const vec4 shift = dims.has_bias != 0 ? mix(vec4(0), LD4(bias, quad), inside) : vec4(0);
    const uint base = ((quad * dims.n + tile.image) * dims.height + uint(tile.row)) * dims.width + uint(tile.column);
    [[unroll]] for (uint j = 0; j < kTile; ++j) {
        apply_at(ROW_OF(values, j));
        if (kExact == 0 && uint(tile.row) + j >= dims.height) continue;
        [[unroll]] for (uint i = 0; i < kTile; ++i) {
            if (kExact == 0 && uint(tile.column) + i >= dims.width) continue;
            const uint at = base + j * dims.width + i;
            vec4 value = values[j * kRow + i] + shift;
            if (kResidual != 0) value += LD4(residual, at);
            values[j * kRow + i] = value * dims.scale;
            if (kExact == 0)
                ST4(y, at, values[j * kRow + i]);
            else if (i % 2 == 1)
                ST8_ALL(y_pairs, at / 2, values[j * kRow + i - 1], values[j * kRow + i]);
        }
    }
}
