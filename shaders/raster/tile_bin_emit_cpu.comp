#version 460
// Like tile_bin_emit.comp, for devices whose shaders run on a CPU. A workgroup of 8 lanes walks one chunk of the
// depth order (those of tile_bin_reduce_cpu.comp) and computes where each entry's pairs begin. Each workgroup sums
// all chunks and decides as tile_bin_scan.comp does, which is cheaper than another dispatch. Needs a workgroup of
// one subgroup.
// Bindings: order, sums [params.lanes] pairs of each chunk, slot_begins, footprints; pairs, slots, large, stats,
// as there; sorted, pair_count (written here). Specialisation as there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_vote : require
#include "load.glsl"
#include "store.glsl"
#include "params/tile_bin_params.h"
#include "saturating.glsl"
#include "raster/tile_footprint.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinSlotsId) const bool kSlots = false;
UINTS(0, order);
UINTS(1, sums);
UINTS(2, slot_begins);
UINTS(3, footprints);
PAIRS_OUT(4, pairs);
layout(set = 0, binding = 5, std430) writeonly buffer Slots { uint slots[]; };
PAIRS_OUT(6, large);
layout(set = 0, binding = 7, std430) buffer Stats { uint stats[]; };  // accumulates
UINTS(8, sorted);
layout(set = 0, binding = 9, std430) writeonly buffer PairCount { uint pair_count[]; };
layout(push_constant) uniform Push { TileBinParams params; };

#include "raster/tile_bin.glsl"

// A lane's entry of the depth order and where its pairs begin.
struct Entry {
    uint at, item, count, begin;
    uvec2 packed;
};

// The next entries from `first`, up to 8 before `end`. base: pairs before them; then up to their end.
Entry entry_of_lane(uint first, uint end, uint lane, inout uint base) {
    Entry e;
    e.at = first + lane;
    e.item = LD1(order, 2 * min(e.at, end - 1) + 1);
    e.packed = uvec2(LD1(footprints, 2 * e.item), LD1(footprints, 2 * e.item + 1));
    e.count = e.at < end ? tiles_of(e.packed) : 0;
    uint sum = e.count;  // sum over this lane and those before
    [[unroll]] for (uint s = 0; s < 3; ++s) {
        const uint step = 1u << s;
        const uint other = subgroupShuffle(sum, (lane - step) & 7u);
        sum += lane >= step ? other : 0;
    }
    e.begin = base + sum - e.count;
    base += subgroupShuffle(sum, 7u);
    return e;
}

bool is_large(Entry e) { return e.count > 0 && e.packed.x == kNotPacked; }

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
    [[unroll]] for (uint s = 0; s < 3; ++s) {
        total = saturating_add(total, subgroupShuffleXor(total, 1u << s));
        base = saturating_add(base, subgroupShuffleXor(base, 1u << s));
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
    const uint chunk_base = base;
    bool any_large = false;
    uint i = chunk.x;
    do {
        const Entry e = entry_of_lane(i, chunk.y, lane, base);
        any_large = any_large || is_large(e);
        if (e.count > 0 && !is_large(e)) {
            const uint slot = kSlots ? LD1(slot_begins, e.item) : 0;
            TileWalk walk = first_tile(e.packed);
            uint pair = 0, taken;
            do {  // the next turn overwrites what a turn without a tile stores
                ST2(pairs, e.begin + pair, uvec2(take_tile(walk, taken), e.item));
                if (kSlots) slots[e.begin + pair] = slot + pair;
                pair += taken;
            } while (pair < e.count);
        }
        i += 8;
    } while (i < chunk.y);
    // A separate walk: lavapipe runs both sides of a branch, and large footprints are rare.
    if (!subgroupAny(any_large)) return;
    base = chunk_base;
    i = chunk.x;
    do {
        const Entry e = entry_of_lane(i, chunk.y, lane, base);
        if (is_large(e)) {
            const uint to = atomicAdd(stats[kStatLarge], 1u);
            ST2(large, to, uvec2(e.item, e.begin));
        }
        i += 8;
    } while (i < chunk.y);
}
