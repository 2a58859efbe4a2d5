#version 460
// Counts digits for one pass of a stable least-significant-digit radix sort: every lane owns a
// contiguous chunk of the entries and a column of counters of its own, so that there are no atomics,
// and stability comes for free. table [lanes][bins].
// Bindings: keys (read 4 at a time), entries (their number); table.
// Specialisation: 10 = bits of a digit, 13 = first pass, which leaves out keys 0xFFFFFFFF.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/radix_sort_params.h"
#include "lane_quads.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 4;
layout(constant_id = 13) const bool kFirst = false;
UINT_QUADS(0, keys);
UINTS(1, entries);
layout(set = 0, binding = 2, std430) writeonly buffer Table { uint table[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

const uint kBins = 1u << kBits;
shared uint column[kBins * gl_WorkGroupSize.x];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x, shift = params.shift;
    const uint lane = gl_WorkGroupID.x * width + l;
    for (uint bin = 0; bin < kBins; ++bin) column[bin * width + l] = 0;
    const uint count = min(LD1(entries, 0), params.capacity);
    const uvec2 quads = lane_quads(lane, count, params.lanes);
    for (uint i = quads.x; i < quads.y; ++i) {
        const uvec4 key = LDU4(keys, i);
        [[unroll]] for (uint e = 0; e < 4; ++e)
            if (4 * i + e < count && (!kFirst || key[e] != 0xFFFFFFFFu))
                ++column[((key[e] >> shift) & (kBins - 1)) * width + l];
    }
    for (uint bin = 0; bin < kBins; ++bin) table[lane * kBins + bin] = column[bin * width + l];
}
