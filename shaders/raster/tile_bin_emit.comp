#version 460
// One pair for every tile that a Gaussian reaches, Gaussians in depth order, so that a stable sort by
// tile alone gives lists in depth order. One invocation does one entry of the order. Should it find
// fewer tiles than were counted, the rest gets the key 0xFFFFFFFF, which the sort leaves out.
// Bindings: splats, counts, begins, order, stats; keys [pairs] tile, items [pairs] view * N + Gaussian.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/tile_bin_params.h"
#include "tile_footprint.glsl"

layout(local_size_x_id = 0) in;
QUADS(0, splats);
UINTS(1, counts);
UINTS(2, begins);
UINTS(3, order);
UINTS(4, stats);
layout(set = 0, binding = 5, std430) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Items { uint items[]; };
layout(push_constant) uniform Push { TileBinParams params; };

#include "launch.glsl"

void main() {
    const uint length = LD1(stats, kStatVisible);
    const uint wanted = (length + params.emit_group - 1) / params.emit_group;
    const uint at = invocation_index(min(wanted, params.max_groups));
    if (at >= length) return;
    const uint item = LD1(order, at);
    uint pair = LD1(begins, item);
    const uint end = pair + LD1(counts, item);
    if (pair == end) return;
    const ivec2 size = ivec2(params.width, params.height);
    const uint tiles_x = (params.width + 15) >> 4;
    const uint view = item / params.gaussians;
    const uint window = view * (params.row_end - params.row_begin);
    const Footprint f = tile_footprint(LD4(splats, item * 3), LD4(splats, item * 3 + 1),
                                       LD4(splats, item * 3 + 2).w, params.flags, size, ivec2(params.row_begin, params.row_end));
    for (int row = f.rect.y; row < f.rect.w; ++row) {
        const ivec2 columns = tile_columns(f, row, size);
        const uint row_key = (window + uint(row) - params.row_begin) * tiles_x;
        for (int x = columns.x; x < columns.y && pair < end; ++x, ++pair) {
            keys[pair] = row_key + uint(x);
            items[pair] = item;
        }
    }
    for (; pair < end; ++pair) {
        keys[pair] = 0xFFFFFFFFu;
        items[pair] = item;
    }
}
