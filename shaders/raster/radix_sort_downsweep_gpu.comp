#version 460
// As radix_sort_downsweep.comp for GPUs: the workgroup walks its chunk in steps of its size. Within a
// step an entry's rank among those of its digit is the number before it in its subgroup, found with a
// ballot per bit (Ashkiani et al. 2016, GPU multisplit), and in the subgroups before it.
// Bindings and specialisation as there. Any subgroup size; a workgroup of whole subgroups.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#include "lane_quads.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 8;
layout(constant_id = 11) const bool kPositions = false;
layout(constant_id = 12) const bool kSecond = false;
layout(constant_id = 13) const bool kFirst = false;
layout(set = 0, binding = 0, std430) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 1, std430) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 2, std430) readonly buffer Seconds { uint seconds[]; };
layout(set = 0, binding = 3, std430) readonly buffer Entries { uint entries[]; };
layout(set = 0, binding = 4, std430) readonly buffer Table { uint table[]; };
layout(set = 0, binding = 5, std430) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 6, std430) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 7, std430) writeonly buffer ValuesOut { uint values_out[]; };
layout(set = 0, binding = 8, std430) writeonly buffer SecondsOut { uint seconds_out[]; };
layout(set = 0, binding = 9, std430) writeonly buffer Kept { uint kept[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

const uint kBins = 1u << kBits;
const uint kMaxSubgroups = 16;  // of a workgroup of 128; subgroups smaller than 8 are not supported
shared uint places[kBins];      // next place of each digit
shared uint ranks[kMaxSubgroups * kBins];

// The places of each digit's first entry in this chunk.
void first_places() {
    const uint l = gl_LocalInvocationID.x;
    for (uint bin = l; bin < kBins; bin += gl_WorkGroupSize.x) ranks[bin] = totals[bin];
    barrier();
    for (uint bin = l; bin < kBins; bin += gl_WorkGroupSize.x) {
        uint before = 0;
        for (uint smaller = 0; smaller < bin; ++smaller) before += ranks[smaller];
        places[bin] = before + table[gl_WorkGroupID.x * kBins + bin];
        if (gl_WorkGroupID.x == 0 && bin == kBins - 1) kept[0] = before + ranks[bin];
    }
    barrier();
}

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    first_places();
    const uint count = min(entries[0], params.capacity);
    const uvec2 chunk = 4 * lane_quads(gl_WorkGroupID.x, count, params.lanes);
    for (uint start = chunk.x; start < min(chunk.y, count); start += width) {
        const uint i = start + l;
        const bool inside = i < min(chunk.y, count);
        const uint key = inside ? keys[i] : 0;
        const bool stays = inside && (!kFirst || key != 0xFFFFFFFFu);
        const uint digit = (key >> params.shift) & (kBins - 1);
        uvec4 same = subgroupBallot(stays);
        for (uint b = 0; b < kBits; ++b) {
            const bool set = ((digit >> b) & 1u) != 0;
            const uvec4 with = subgroupBallot(set);
            same &= set ? with : ~with;
        }
        const uint rank = subgroupBallotExclusiveBitCount(same);
        for (uint at = l; at < gl_NumSubgroups * kBins; at += width) ranks[at] = 0;
        barrier();
        if (stays && rank == 0) ranks[gl_SubgroupID * kBins + digit] = subgroupBallotBitCount(same);
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
            const uint place = ranks[gl_SubgroupID * kBins + digit] + rank;
            keys_out[place] = key;
            values_out[place] = kPositions ? i : values[i];
            if (kSecond) seconds_out[place] = seconds[i];
        }
        barrier();
    }
}
