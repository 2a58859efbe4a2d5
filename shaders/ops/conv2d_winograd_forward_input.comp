#version 460
// V = B^T x B of every tile of a slice and channel, zeros or the nearest pixel where the image ends. Tiles from
// dims.tiles to the end of the dispatch are zero.
// One invocation transforms one tile of 4 kParts channels. Workgroups: tiles, these parts of octets of channels.
// Bindings: x quads [C/4][N*H*W], transformed [kSize^2][ceil(C/8)][stride] pairs of quads.
// Specialisation: workgroup size, kTile, kParts: 2, or 1 where 72 quads are too many registers; kReplicate.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_winograd_params.h"
#include "winograd.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kWinogradPartsId) const uint kParts = 2;
layout(constant_id = kWinogradReplicateId) const uint kReplicate = 0;
QUADS(0, x);
OCTETS_OUT(1, transformed);
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#include "winograd_tile.glsl"

void main() {
    const uint t = gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    const uint octet = gl_WorkGroupID.y * kParts / 2;
    const uint first = gl_WorkGroupID.y * kParts % 2;
    const uint octets = (dims.in_channels + 7) / 8;
    const uint quads = (dims.in_channels + 3) / 4;
    const Tile tile = tile_at(t);
    const int pixels = int(dims.height * dims.width);

    vec4 values[2 * kRow * kRow];
    [[unroll]] for (uint part = 0; part < kParts; ++part) {
        const uint quad = 2 * octet + first + part;
        const int base = int(quad * dims.n + tile.image) * pixels;
        const bool inside = t < dims.tiles && quad < quads;
        [[unroll]] for (uint i = 0; i < kSize; ++i) {
            int column = tile.column + int(i) - 1;
            if (kReplicate != 0) column = clamp(column, 0, int(dims.width) - 1);
            const bool inside_column = inside && (kReplicate != 0 || uint(column) < dims.width);
            [[unroll]] for (uint j = 0; j < kSize; ++j) {
                int row = tile.row + int(j) - 1;
                if (kReplicate != 0) row = clamp(row, 0, int(dims.height) - 1);
                const bool valid = inside_column && (kReplicate != 0 || uint(row) < dims.height);
                const vec4 value = LD4(x, valid ? base + row * int(dims.width) + column : 0);
                values[part * kRow * kRow + j * kRow + i] = valid ? value : vec4(0);
            }
            apply_bt(COLUMN_OF(values, part * kRow * kRow + i));
        }
    }
    [[unroll]] for (uint j = 0; j < kSize; ++j) {
        apply_bt(ROW_OF(values, j));
        if (kParts == 2) apply_bt(ROW_OF(values, kRow + j));
        [[unroll]] for (uint i = 0; i < kSize; ++i) {
            const uint at = ((j * kSize + i) * octets + octet) * dims.stride + t;
#if !TEXEL_LOADS
            if (kParts == 1) {
                transformed[2 * at + first] = values[j * kRow + i];
                continue;
            }
#endif
            ST8_ALL(transformed, at, values[j * kRow + i], values[kRow * kRow + j * kRow + i]);
        }
    }
}
