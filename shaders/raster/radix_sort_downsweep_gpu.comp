#version 460
// Like radix_sort_downsweep.comp, for GPUs. The workgroup walks its chunk in steps of its own size. An entry's
// rank within a step is the number of entries of its digit before it: in its subgroup, found with one
// ballot per bit (Ashkiani et al. 2016, GPU multisplit), and in earlier subgroups.
// Bindings and specialisation as there, table of radix_sort_upsweep_gpu.comp. Any subgroup size; a workgroup of whole
// subgroups.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#include "params/radix_sort_params.h"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 8;
layout(constant_id = kRadixSortSecondId) const bool kSecond = false;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { uvec2 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Entries { uvec2 entries[]; };
UINT_TABLE(2, input_count);
layout(set = 0, binding = 3, std430) buffer Kept { uint kept[]; };  // accumulates
layout(set = 0, binding = 4, std430) readonly buffer Table { uint table[]; };
layout(set = 0, binding = 5, std430) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 6, std430) readonly buffer Seconds { uint seconds[]; };
layout(set = 0, binding = 7, std430) writeonly buffer EntriesOut { uvec2 entries_out[]; };
layout(set = 0, binding = 8, std430) writeonly buffer SecondsOut { uint seconds_out[]; };
UINT_TABLE(9, range);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

const uint kBins = 1u << kBits;
layout(constant_id = kRadixSortMaxSubgroupsId) const uint kMaxSubgroups = 16;
shared uint places[kBins];      // next place of each digit
shared uint ranks[kMaxSubgroups * kBins];
#define ORDER_SCRATCH ranks
#include "ordered_index.glsl"

// Where each digit's first entry of this chunk goes: sums of totals, of twice as many with every step.
void first_places(Digit digit) {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x, bins = 1u << digit.bits;
    for (uint bin = l; bin < bins; bin += width) ranks[bin] = totals[bin];
    barrier();
    for (uint step = 1; step < bins; step <<= 1) {
        for (uint bin = l; bin < bins; bin += width) places[bin] = ranks[bin] + (bin >= step ? ranks[bin - step] : 0);
        barrier();
        for (uint bin = l; bin < bins; bin += width) ranks[bin] = places[bin];
        barrier();
    }
    for (uint bin = l; bin < bins; bin += width) {
        places[bin] = (bin > 0 ? ranks[bin - 1] : 0) + table[bin * params.lanes + gl_WorkGroupID.x];
        if (digit.first && gl_WorkGroupID.x == 0 && bin == bins - 1) kept[0] = ranks[bin];
    }
    barrier();
}

void main() {
    if (gl_NumSubgroups > kMaxSubgroups) {  // smaller ones than the driver tells: the self-test finds it
        if (params.pass == 0) kept[0] = 0;
        return;
    }
    const Digit digit = kRanged ? ranged_digit(TABLE1(range, 0), TABLE1(range, 1), kBits) : fixed_digit(kBits);
    if (digit.bits == 0) return;
    const uint l = ordered_index(), width = gl_WorkGroupSize.x;
    first_places(digit);
    uint count = min(TABLE1(input_count, 0), params.capacity);
    if (!digit.first) count = kept[0];
    const uvec2 chunk = 4 * lane_quads(gl_WorkGroupID.x, count, params.lanes);
    for (uint start = chunk.x; start < min(chunk.y, count); start += width) {
        const uint i = start + l;
        const bool inside = i < min(chunk.y, count);
        uvec2 entry = uvec2(0);
        if (inside) entry = digit.first ? inputs[i] : entries[i];
        const bool stays = inside && entry.x != 0xFFFFFFFFu;
        const uint bin_of = digit_of(entry.x, digit);
        uvec4 same = subgroupBallot(stays);
        for (uint b = 0; b < kBits; ++b) {
            const bool set = ((bin_of >> b) & 1u) != 0;
            const uvec4 with = subgroupBallot(set);
            same &= set ? with : ~with;
        }
        const uint rank = subgroupBallotExclusiveBitCount(same);
        for (uint at = l; at < gl_NumSubgroups * kBins; at += width) ranks[at] = 0;
        barrier();
        if (stays && rank == 0) ranks[gl_SubgroupID * kBins + bin_of] = subgroupBallotBitCount(same);
        barrier();
        for (uint bin = l; bin < kBins; bin += width) {
            uint place = places[bin];
            for (uint s = 0; s < gl_NumSubgroups; ++s) {
                const uint in_subgroup = ranks[s * kBins + bin];
                ranks[s * kBins + bin] = place;
                place += in_subgroup;
            }
            places[bin] = place;
        }
        barrier();
        if (stays) {
            const uint place = ranks[gl_SubgroupID * kBins + bin_of] + rank;
            entries_out[place] = entry;
            if (kSecond) seconds_out[place] = seconds[i];
        }
        barrier();
    }
}
