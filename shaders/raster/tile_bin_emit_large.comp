#version 460
// Like tile_bin_emit.comp, for the footprints that are not packed, which it computes again. One invocation
// takes every stride-th of them, as many as its loops allow (src/vk/launch.h): usually there are none, and
// each idle group costs time. If it finds fewer tiles than were counted, the remaining pairs get the key
// 0xFFFFFFFF, which the sort leaves out.
// Bindings: splats, large uvec2 (item, first pair), slot_begins, stats, footprints; counts, pairs, slots;
// background, active_tiles of call_views.glsl, view_ranges.
// Specialisation: kSlots: write slots, kFlags.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/tile_bin_params.h"
#include "table.glsl"
#include "raster/tile_footprint.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinSlotsId) const bool kSlots = false;
layout(constant_id = kProjectFlagsId) const uint kFlags = 0;
QUADS(0, splats);
UINTS(1, large);
UINTS(2, slot_begins);
UINTS(3, stats);
UINTS(4, footprints);
layout(set = 0, binding = 5, std430) writeonly buffer Counts { uint counts[]; };
PAIRS_OUT(6, pairs);
layout(set = 0, binding = 7, std430) writeonly buffer Slots { uint slots[]; };
TABLE(8, background);
UINT_TABLE(9, active_tiles);
UINT_TABLE(10, view_ranges);
layout(push_constant) uniform Push { TileBinParams params; };

#include "raster/call_views.glsl"
#include "raster/view_ranges.glsl"
#include "launch.glsl"

void emit(uint i) {
    const uint item = LD1(large, 2 * i), begin = LD1(large, 2 * i + 1);
    const uint end = begin + LD1(footprints, 2 * item + 1);
    const uint slot = (kSlots ? LD1(slot_begins, item) : 0) - begin;
    uint view;
    if ((kFlags & kFlagRanges) == 0) view = item / params.gaussians;
    else VIEW_AT(item, kRangeItems, params.views, view)
    const ivec2 size = view_size(view);
    const uint tiles_x = (params.width + 15) >> 4;
    const uint window = view * (params.row_end - params.row_begin);
    const Footprint f = tile_footprint(LD4(splats, item * 3), LD4(splats, item * 3 + 1),
                                       LD4(splats, item * 3 + 2).w, kFlags, size,
                                       view_rows(size));
    uint pair = begin;
    for (int row = f.rect.y; row < f.rect.w; ++row) {
        const ivec2 columns = tile_columns(f, row, size);
        const uint row_key = (window + uint(row) - params.row_begin) * tiles_x;
        for (int x = columns.x; x < columns.y && pair < end; ++x) {
            if ((kFlags & kFlagTileMask) != 0 && !tile_is_active(view, row, x)) continue;
            ST2(pairs, pair, uvec2(row_key + uint(x), item));
            if (kSlots) slots[pair] = slot + pair;
            ++pair;
        }
    }
    if (pair < end) counts[item] = pair - begin;
    for (; pair < end; ++pair) ST2(pairs, pair, uvec2(0xFFFFFFFFu, item));
}

void main() {
    const uint count = LD1(stats, kStatLarge);
    for (uint i = invocation_index(params.groups_x); i < count; i += params.stride) emit(i);
}
