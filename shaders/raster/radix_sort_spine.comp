#version 460
// Exclusive sums over the lanes of the table of radix_sort_upsweep.comp, for each bin, and the bins'
// totals. One invocation does one bin. Bindings: table [lanes][bins] in place, totals [bins].
// Specialisation: 10 = bits of a digit.
#extension GL_GOOGLE_include_directive : require
#include "params/radix_sort_params.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 4;
layout(set = 0, binding = 0, std430) buffer Table { uint table[]; };  // accumulates
layout(set = 0, binding = 1, std430) writeonly buffer Totals { uint totals[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

const uint kBins = 1u << kBits;

void main() {
    const uint bin = gl_GlobalInvocationID.x;
    if (bin >= kBins) return;
    uint before = 0;
    for (uint lane = 0; lane < params.lanes; ++lane) {
        const uint count = table[lane * kBins + bin];
        table[lane * kBins + bin] = before;
        before += count;
    }
    totals[bin] = before;
}
