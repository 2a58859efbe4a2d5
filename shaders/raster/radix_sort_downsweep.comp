#version 460
// Moves every entry to its place: the entries of smaller digits, then those of the same digit in
// lanes before, then those before it in its own lane. Chunks as in radix_sort_upsweep.comp.
// In the first pass (params.first) a value is the entry's position, and keys 0xFFFFFFFF are left
// out; the number of entries that stay goes to `kept`.
// Bindings: keys, values, entries, table, totals; keys_out, values_out, kept.
// Specialisation: 10 = bits of a digit.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 4;
UINTS(0, keys);
UINTS(1, values);
UINTS(2, entries);
UINTS(3, table);
UINTS(4, totals);
layout(set = 0, binding = 5, std430) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 6, std430) writeonly buffer ValuesOut { uint values_out[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Kept { uint kept[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

const uint kBins = 1u << kBits;
shared uint column[kBins * gl_WorkGroupSize.x];
shared uint bases[kBins];
shared uint part_sums[gl_WorkGroupSize.x];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint lane = gl_WorkGroupID.x * width + l;
    const uint share = (kBins + width - 1) / width;
    const uint first_bin = min(l * share, kBins), last_bin = min(first_bin + share, kBins);
    uint sum = 0;
    for (uint bin = first_bin; bin < last_bin; ++bin) sum += LD1(totals, bin);
    part_sums[l] = sum;
    barrier();
    uint base = 0;
    for (uint i = 0; i < l; ++i) base += part_sums[i];
    for (uint bin = first_bin; bin < last_bin; ++bin) {
        bases[bin] = base;
        base += LD1(totals, bin);
    }
    if (gl_WorkGroupID.x == 0 && l == width - 1) kept[0] = base;
    barrier();
    for (uint bin = 0; bin < kBins; ++bin)
        column[bin * width + l] = bases[bin] + LD1(table, lane * kBins + bin);

    const uint count = min(LD1(entries, 0), params.capacity);
    const uint chunk = (count + params.lanes - 1) / params.lanes;
    const uint begin = min(lane * chunk, count), end = min(begin + chunk, count);
    for (uint i = begin; i < end; ++i) {
        const uint key = LD1(keys, i);
        if (params.first != 0 && key == 0xFFFFFFFFu) continue;
        const uint at = ((key >> params.shift) & (kBins - 1)) * width + l;
        const uint place = column[at];
        column[at] = place + 1;
        keys_out[place] = key;
        values_out[place] = params.first != 0 ? i : LD1(values, i);
    }
}
