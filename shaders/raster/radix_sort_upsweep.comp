#version 460
// Counts digits for one pass of a stable least-significant-digit radix sort. Every lane owns a
// contiguous chunk of the entries and its own counters, which needs no atomics and keeps the sort stable.
// The counters are private: lavapipe takes three times as long with shared memory.
// table [lanes][bins].
// Bindings: inputs, entries [capacity] uvec2 (key, value; read 2 at a time; inputs in the first pass),
// input_count, kept; table; range of radix_sort_range.comp.
// Specialisation: kBits: most bits of a digit, kRanged: digits by the range of the keys.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 4;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
UINT_QUADS(0, inputs);
UINT_QUADS(1, entries);
UINTS(2, input_count);
UINTS(3, kept);
layout(set = 0, binding = 4, std430) writeonly buffer Table { uint table[]; };
UINTS(5, range);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

uint counters[1u << kBits];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint lane = gl_WorkGroupID.x * width + l;
    const Digit digit =
        kRanged ? ranged_digit(LD1(range, 0), LD1(range, 1), kBits) : fixed_digit(kBits);
    const uint count = digit.first ? min(LD1(input_count, 0), params.capacity) : LD1(kept, 0);
    const uint lanes = lanes_for(count);
    const uint bins = lane < lanes && digit.bits > 0 ? 1u << digit.bits : 0u;
    for (uint bin = 0; bin < bins; ++bin) counters[bin] = 0;
    const uvec2 quads = digit.bits > 0 ? lane_quads(lane, count, lanes) : uvec2(0);
    for (uint i = quads.x; i < quads.y; ++i) {
        [[unroll]] for (uint h = 0; h < 2; ++h) {
            const uint at = 2 * i + h;
            const uvec4 two = digit.first ? LDU4(inputs, at) : LDU4(entries, at);
            [[unroll]] for (uint e = 0; e < 2; ++e)
                if (2 * at + e < count && two[2 * e] != 0xFFFFFFFFu)
                    ++counters[digit_of(two[2 * e], digit)];
        }
    }
    for (uint bin = 0; bin < bins; ++bin) table[lane * bins + bin] = counters[bin];
}
