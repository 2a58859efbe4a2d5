#version 460
// Writes one pair for every tile that a Gaussian reaches, Gaussians in depth order, so that a stable sort
// by tile gives lists in depth order. One invocation computes one entry of the order. Footprints that are
// not packed go to a list, in any order, for tile_bin_emit_large.comp.
// Bindings: order uvec2 (depth, item), begins [sorted], slot_begins [V*N], footprints; pairs uvec2 (tile, item),
// slots [pairs] record of the backward pass, large [sorted] uvec2 (item, first pair), stats of tile_bin_scan.comp.
// Specialisation: kSlots: write slots.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/tile_bin_params.h"
#include "raster/tile_footprint.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinSlotsId) const bool kSlots = false;
UINTS(0, order);
UINTS(1, begins);
UINTS(2, slot_begins);
UINTS(3, footprints);
PAIRS_OUT(4, pairs);
layout(set = 0, binding = 5, std430) writeonly buffer Slots { uint slots[]; };
PAIRS_OUT(6, large);
layout(set = 0, binding = 7, std430) buffer Stats { uint stats[]; };  // accumulates
layout(push_constant) uniform Push { TileBinParams params; };

#include "launch.glsl"
#include "raster/tile_bin.glsl"

void main() {
    const uint at = invocation_index(params.groups_x);
    if (at >= stats[kStatVisible] || stats[kStatPairs] == 0) return;
    const uint item = LD1(order, 2 * at + 1);
    const uvec2 packed = uvec2(LD1(footprints, 2 * item), LD1(footprints, 2 * item + 1));
    const uint begin = LD1(begins, at);
    if (packed.x == kNotPacked) {
        const uint to = atomicAdd(stats[kStatLarge], 1u);
        ST2(large, to, uvec2(item, begin));
        return;
    }
    const uint slot = kSlots ? LD1(slot_begins, item) : 0;
    const uint count = tiles_of(packed);
    if (count == 0) return;
    TileWalk walk = first_tile(packed);
    uint pair = 0, taken;
    do {  // the next turn overwrites what a turn without a tile stores
        ST2(pairs, begin + pair, uvec2(take_tile(walk, taken), item));
        if (kSlots) slots[begin + pair] = slot + pair;
        pair += taken;
    } while (pair < count);
}
