#version 460
// Counts digits for one pass of a stable least-significant-digit radix sort: every lane owns a
// contiguous chunk of the entries and a column of counters of its own, so that there are no atomics,
// and stability comes for free. table [lanes][bins].
// Bindings: keys (read 4 at a time), entries (their number); table; range of radix_sort_range.comp.
// Specialisation: 10 = most bits of a digit, 13 = first pass, which leaves out keys 0xFFFFFFFF,
// 15 = digits by the range of the keys.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/radix_sort_params.h"
#include "lane_quads.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 4;
layout(constant_id = 13) const bool kFirst = false;
layout(constant_id = 15) const bool kRanged = false;
UINT_QUADS(0, keys);
UINTS(1, entries);
layout(set = 0, binding = 2, std430) writeonly buffer Table { uint table[]; };
UINTS(3, range);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

shared uint column[gl_WorkGroupSize.x << kBits];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint lane = gl_WorkGroupID.x * width + l;
    const uint count = min(LD1(entries, 0), params.capacity), lanes = lanes_for(count);
    Digit digit = Digit(0, params.shift, kBits);
    if (kRanged) digit = ranged_digit(LD1(range, 0), LD1(range, 1), kBits);
    const uint bins = lane < lanes && digit.bits > 0 ? 1u << digit.bits : 0u;
    for (uint bin = 0; bin < bins; ++bin) column[bin * width + l] = 0;
    const uvec2 quads = digit.bits > 0 ? lane_quads(lane, count, lanes) : uvec2(0);
    for (uint i = quads.x; i < quads.y; ++i) {
        const uvec4 key = LDU4(keys, i);
        [[unroll]] for (uint e = 0; e < 4; ++e)
            if (4 * i + e < count && (!kFirst || key[e] != 0xFFFFFFFFu))
                ++column[digit_of(key[e], digit) * width + l];
    }
    for (uint bin = 0; bin < bins; ++bin) table[lane * bins + bin] = column[bin * width + l];
}
