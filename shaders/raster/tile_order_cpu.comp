#version 460
// The order in which workgroups take the tiles: lavapipe gives each thread one contiguous run of
// workgroups, and a tile with a long list keeps its thread busy. Tiles are ranked by length, longest
// first, ties by index, and dealt to halves of the order back and forth (first, second, second, first,
// ...), those of each half to its halves likewise, and so on: rank r comes in the order of its Gray code's
// bits reversed, so that for 2, 4, 8 ... threads the runs are about equally long.
// One invocation does one tile, 8 lanes share what they read. Needs subgroups of at least 8.
// Bindings: ranges [tiles] 2 uint, of tile_ranges.comp; order [tiles].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "params/tile_bin_params.h"

layout(local_size_x_id = 0) in;
UINTS(0, ranges);
layout(set = 0, binding = 1, std430) writeonly buffer Order { uint order[]; };
layout(push_constant) uniform Push { TileBinParams params; };

#include "launch.glsl"

uint length_of(uint tile) {
    const uint at = 2 * min(tile, params.tiles - 1);
    return tile < params.tiles ? LD1(ranges, at + 1) - LD1(ranges, at) : 0;
}

uint dealt(uint rank) {
    return bitfieldReverse(rank ^ (rank >> 1));
}

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uint tile = invocation_index(params.groups_x);
    const uint own = length_of(tile);
    uint rank = 0;
    uint k = 0;
    do {
        const uint lengths = length_of(k + lane);
        [[unroll]] for (uint j = 0; j < 8; ++j) {
            const uint other = subgroupShuffle(lengths, j);
            rank += other > own || (other == own && k + j < tile) ? 1 : 0;
        }
        k += 8;
    } while (k < params.tiles);
    const uint own_turn = dealt(rank);
    uint place = 0;
    k = 0;
    do {
        const uint turns = k + lane < params.tiles ? dealt(k + lane) : ~0u;
        [[unroll]] for (uint j = 0; j < 8; ++j) place += subgroupShuffle(turns, j) < own_turn ? 1 : 0;
        k += 8;
    } while (k < params.tiles);
    if (tile < params.tiles) order[place] = tile;
}
