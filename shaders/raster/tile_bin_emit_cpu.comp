#version 460
// As tile_bin_emit.comp for devices whose shaders run on a CPU: a workgroup of 8 lanes walks a chunk of the depth
// order, of tile_bin_reduce_cpu.comp, and knows where each entry's pairs begin; it stores first pairs of large
// footprints alone. Each workgroup sums all chunks and decides as tile_bin_scan.comp does, which costs less than a
// dispatch of its own. Needs a workgroup of one subgroup.
// Bindings: order, sums [params.lanes] pairs of each chunk, slot_begins, sorted, pair_count (written here), footprints;
// pairs, slots, large, begins [sorted] of entries with large footprints, stats. Specialisation as there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/tile_bin_params.h"
#include "saturating.glsl"
#include "tile_footprint.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const bool kSlots = false;
UINTS(0, order);
UINTS(1, sums);
UINTS(2, slot_begins);
UINTS(3, sorted);
layout(set = 0, binding = 4, std430) writeonly buffer PairCount { uint pair_count[]; };
UINT_QUADS(5, footprints);
PAIRS_OUT(6, pairs);
layout(set = 0, binding = 7, std430) writeonly buffer Slots { uint slots[]; };
layout(set = 0, binding = 8, std430) writeonly buffer Large { uint large[]; };
layout(set = 0, binding = 9, std430) writeonly buffer Begins { uint begins[]; };
layout(set = 0, binding = 10, std430) buffer Stats { uint stats[]; };  // accumulates
layout(push_constant) uniform Push { TileBinParams params; };

#include "tile_bin.glsl"

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    uint base = 0, total = 0;
    uint first = 0;
    do {  // params.lanes is a multiple of 16
        [[unroll]] for (uint j = 0; j < 16; j += 8) {
            const uint sum = LD1(sums, first + j + lane);
            total = saturating_add(total, sum);
            base = saturating_add(base, first + j + lane < gl_WorkGroupID.x ? sum : 0);
        }
        first += 16;
    } while (first < params.lanes);
    [[unroll]] for (uint step = 1; step < 8; step *= 2) {
        total = saturating_add(total, subgroupShuffle(total, lane ^ step));
        base = saturating_add(base, subgroupShuffle(base, lane ^ step));
    }
    const bool fits = total <= params.capacity;
    const uint entries = LD1(sorted, 0);
    if (gl_GlobalInvocationID.x == 0) {
        stats[kStatVisible] = entries;
        stats[kStatNeeded] = total;
        stats[kStatPairs] = fits ? total : 0;
        pair_count[0] = fits ? total : 0;
    }
    const uvec2 chunk = tile_chunk(gl_WorkGroupID.x, entries);
    if (chunk.x >= chunk.y || !fits || total == 0) return;
    uint i = chunk.x;
    do {
        const uint at = i + lane;
        const uint item = LD1(order, 2 * min(at, chunk.y - 1) + 1);
        const uvec4 packed = LDU4(footprints, item);
        const uint count = at < chunk.y ? packed.w : 0;
        uint sum = count;  // of this lane and those before
        [[unroll]] for (uint step = 1; step < 8; step *= 2) {
            const uint other = subgroupShuffle(sum, (lane - step) & 7u);
            sum += lane >= step ? other : 0;
        }
        const uint begin = base + sum - count;
        base += subgroupShuffle(sum, 7u);
        if (count > 0 && packed.x == kNotPacked) {
            begins[at] = begin;
            large[atomicAdd(stats[kStatLarge], 1u)] = at;
        } else if (count > 0) {
            const uint slot = kSlots ? LD1(slot_begins, item) : 0;
            TileWalk walk = first_tile(packed, item);
            uint pair = 0;
            do {
                ST2(pairs, begin + pair, uvec2(take_tile(walk), item));
                if (kSlots) slots[begin + pair] = slot + pair;
            } while (++pair < count);
        }
        i += 8;
    } while (i < chunk.y);
}
