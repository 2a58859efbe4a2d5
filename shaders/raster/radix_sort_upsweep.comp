#version 460
// Counts digits for one pass of a stable least-significant-digit radix sort: every lane owns a
// contiguous chunk of the entries and a column of counters of its own, so that there are no atomics,
// and stability comes for free. table [lanes][bins].
// Bindings: keys, entries (their number); table. Specialisation: 10 = bits of a digit.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 4;
UINTS(0, keys);
UINTS(1, entries);
layout(set = 0, binding = 2, std430) writeonly buffer Table { uint table[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

const uint kBins = 1u << kBits;
shared uint column[kBins * gl_WorkGroupSize.x];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint lane = gl_WorkGroupID.x * width + l;
    const uint count = min(LD1(entries, 0), params.capacity);
    const uint chunk = (count + params.lanes - 1) / params.lanes;
    const uint begin = min(lane * chunk, count), end = min(begin + chunk, count);
    for (uint bin = 0; bin < kBins; ++bin) column[bin * width + l] = 0;
    for (uint i = begin; i < end; ++i) {
        const uint key = LD1(keys, i);
        if (params.first == 0 || key != 0xFFFFFFFFu)
            ++column[((key >> params.shift) & (kBins - 1)) * width + l];
    }
    for (uint bin = 0; bin < kBins; ++bin) table[lane * kBins + bin] = column[bin * width + l];
}
