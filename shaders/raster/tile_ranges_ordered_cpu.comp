#version 460
// Like tile_ranges.comp, for devices whose shaders run on a CPU. It also writes the order in which workgroups of
// blending take the tiles: lavapipe gives each thread one contiguous run of workgroups, and a tile with a long
// list keeps its thread busy. Tiles are ranked by length, longest first, ties by index. They are dealt to the
// halves of the order back and forth (first, second, second, first, ...), then in the same way to the halves of
// each half, and so on: rank r moves to the bit-reversed Gray code of r. For 2, 4, 8 ... threads the runs are
// then about equally long. One workgroup with one invocation per tile, a multiple of 8 and at most 512, so that
// one dispatch does both; 8 lanes share what they read. Needs subgroups of at least 8.
// Bindings: pairs, sorted; ranges, stats, as there; order [tiles].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "params/tile_bin_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
UINTS(0, pairs);
UINTS(1, sorted);
layout(set = 0, binding = 2, std430) writeonly buffer Ranges { uvec2 ranges[]; };
layout(set = 0, binding = 3, std430) buffer Stats { uint stats[]; };  // accumulates
layout(set = 0, binding = 4, std430) writeonly buffer Order { uint order[]; };
layout(push_constant) uniform Push { TileBinParams params; };

shared uint lengths[512];

#include "lower_bound.glsl"

uint dealt(uint rank) {
    return bitfieldReverse(rank ^ (rank >> 1));
}

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uint tile = gl_LocalInvocationID.x;
    const uint count = LD1(sorted, 0);
    const uint first = lower_bound(tile, count), last = lower_bound(tile + 1, count);
    const uint own = tile < params.tiles ? last - first : 0;
    lengths[tile] = own;
    if (tile < params.tiles) {
        ranges[tile] = uvec2(first, last);
        atomicMax(stats[kStatLongest], own);
        if (own == 0) atomicAdd(stats[kStatEmptyTiles], 1u);
    }
    barrier();
    uint rank = 0;
    uint k = 0;
    do {
        const uint of_lane = lengths[k + lane];
        [[unroll]] for (uint j = 0; j < 8; ++j) {
            const uint other = subgroupShuffle(of_lane, j);
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
