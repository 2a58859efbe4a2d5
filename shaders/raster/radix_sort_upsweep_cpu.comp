#version 460
// Like radix_sort_upsweep.comp, for devices whose shaders run on a CPU. It also writes each entry's rank among
// the entries of its digit in its chunk, so that entries can be moved in any order
// (radix_sort_downsweep_cpu.comp).
// ranks [capacity / 2, rounded up to even] uint: of two entries, 16 bits each. Bindings and specialisation as
// there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 8;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
UINT_QUADS(0, inputs);
UINT_QUADS(1, entries);
UINTS(2, input_count);
UINTS(3, kept);
layout(set = 0, binding = 4, std430) writeonly buffer Table { uint table[]; };
UINTS(5, range);
PAIRS_OUT(6, ranks);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

uint counters[1u << kBits];

// Counts the entries of `quads`. `from_input` is constant: a branch in the loop would read both arrays.
void count_entries(const bool from_input, uvec2 quads, uint count, Digit digit) {
    uint i = quads.x;
    if (i < quads.y) do {
        uvec2 of_quad;
        [[unroll]] for (uint h = 0; h < 2; ++h) {
            const uint at = 2 * i + h;
            const uvec4 two = from_input ? LDU4(inputs, at) : LDU4(entries, at);
            uint of_two[2];
            [[unroll]] for (uint e = 0; e < 2; ++e) {
                const bool stays = 2 * at + e < count && two[2 * e] != 0xFFFFFFFFu;
                const uint bin = stays ? digit_of(two[2 * e], digit) : 0;
                of_two[e] = counters[bin];
                if (stays) counters[bin] = of_two[e] + 1;
            }
            of_quad[h] = of_two[0] | of_two[1] << 16;
        }
        ST2(ranks, i, of_quad);
    } while (++i < quads.y);
}

void main() {
    const uint lane = gl_GlobalInvocationID.x;
    const Digit digit =
        kRanged ? ranged_digit(LD1(range, 0), LD1(range, 1), kBits) : fixed_digit(kBits);
    const uint count = digit.first ? min(LD1(input_count, 0), params.capacity) : LD1(kept, 0);
    const uint lanes = lanes_for(count);
    const uint bins = lane < lanes && digit.bits > 0 ? 1u << digit.bits : 0u;
    for (uint bin = 0; bin < bins; ++bin) counters[bin] = 0;
    const uvec2 quads = digit.bits > 0 ? lane_quads(lane, count, lanes) : uvec2(0);
    const bool from_input = kRanged && digit.first;  // else `entries` is what the first pass sorts
    if (kRanged) count_entries(true, from_input ? quads : uvec2(0), count, digit);
    count_entries(false, from_input ? uvec2(0) : quads, count, digit);
    for (uint bin = 0; bin < bins; ++bin) table[lane * bins + bin] = counters[bin];
}
