#version 460
// Finds each tile's list [first, last) in the sorted pairs by binary search. One invocation computes
// one tile. Bindings: pairs uvec2 (tile, value; sorted), sorted (their number); ranges [tiles]
// uvec2, stats.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/tile_bin_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
UINTS(0, pairs);
UINTS(1, sorted);
layout(set = 0, binding = 2, std430) writeonly buffer Ranges { uvec2 ranges[]; };
layout(set = 0, binding = 3, std430) buffer Stats { uint stats[]; };  // accumulates
layout(push_constant) uniform Push { TileBinParams params; };

#include "launch.glsl"
#include "lower_bound.glsl"

void main() {
    const uint tile = invocation_index(params.groups_x);
    if (tile >= params.tiles) return;
    const uint count = LD1(sorted, 0);
    const uint first = lower_bound(tile, count), last = lower_bound(tile + 1, count);
    ranges[tile] = uvec2(first, last);
    atomicMax(stats[kStatLongest], last - first);
    if (first == last) atomicAdd(stats[kStatEmptyTiles], 1u);
}
