#version 460
// Exclusive sums along the rows of the table of radix_sort_upsweep.comp, and the rows' totals. One
// workgroup does one bin, each invocation a contiguous part of the row.
// Bindings: table [bins][lanes] in place, totals [bins].
#extension GL_GOOGLE_include_directive : require
#include "params/radix_sort_params.h"

layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0, std430) buffer Table { uint table[]; };  // accumulates
layout(set = 0, binding = 1, std430) writeonly buffer Totals { uint totals[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

shared uint part_sums[gl_WorkGroupSize.x];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint chunk = (params.lanes + width - 1) / width;
    const uint row = gl_WorkGroupID.x * params.lanes;
    const uint begin = row + min(l * chunk, params.lanes);
    const uint end = row + min((l + 1) * chunk, params.lanes);
    uint sum = 0;
    for (uint i = begin; i < end; ++i) sum += table[i];
    part_sums[l] = sum;
    barrier();
    uint before = 0;
    for (uint i = 0; i < l; ++i) before += part_sums[i];
    if (l == width - 1) totals[gl_WorkGroupID.x] = before + sum;
    for (uint i = begin; i < end; ++i) {
        const uint count = table[i];
        table[i] = before;
        before += count;
    }
}
