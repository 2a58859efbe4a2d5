#version 460
// Like radix_sort_downsweep.comp, for devices whose shaders run on a CPU. Using the entries' ranks, the 8 lanes of
// a workgroup walk one chunk together, 16 entries at a time. A chunk per lane would write to 8 times as many
// cache lines at once.
// Bindings: inputs, entries, input_count, kept, places [lanes][bins], ranks, seconds; entries_out,
// seconds_out; range. Specialisation as there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 8;
layout(constant_id = kRadixSortSecondId) const bool kSecond = false;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
UINT_QUADS(0, inputs);
UINT_QUADS(1, entries);
UINTS(2, input_count);
UINTS(3, kept);
UINTS(4, places);
UINTS(5, ranks);
UINT_QUADS(6, seconds);
PAIRS_OUT(7, entries_out);
layout(set = 0, binding = 8, std430) writeonly buffer SecondsOut { uint seconds_out[]; };
UINTS(9, range);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

// Moves the entries of `pairs`, two per lane. `from_input` as in radix_sort_upsweep_cpu.comp.
void move_entries(const bool from_input, uvec2 pairs, uint lane, uint count, uint row, Digit digit) {
    uint at = pairs.x + lane;
    if (at < pairs.y) do {
        const uvec4 two = from_input ? LDU4(inputs, at) : LDU4(entries, at);
        const uint of_two = LD1(ranks, at);
        const uvec4 second = kSecond ? LDU4(seconds, at / 2) : uvec4(0);
        [[unroll]] for (uint e = 0; e < 2; ++e) {
            const uint key = two[2 * e];
            if (2 * at + e < count && key != 0xFFFFFFFFu) {
                const uint place =
                    LD1(places, row + digit_of(key, digit)) + (e == 0 ? of_two & 0xFFFFu : of_two >> 16);
                ST2(entries_out, place, uvec2(key, two[2 * e + 1]));
                if (kSecond) seconds_out[place] = (at & 1u) == 0 ? second[e] : second[2 + e];
            }
        }
        at += 8;
    } while (at < pairs.y);
}

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uint chunk = gl_WorkGroupID.x;
    const Digit digit =
        kRanged ? ranged_digit(LD1(range, 0), LD1(range, 1), kBits) : fixed_digit(kBits);
    const uint count = digit.first ? min(LD1(input_count, 0), params.capacity) : LD1(kept, 0);
    const uint chunks = lanes_for(count);
    if (digit.bits == 0 || chunk >= chunks) return;
    const uvec2 pairs = 2 * lane_quads(chunk, count, chunks);
    const uint row = chunk << digit.bits;
    const bool from_input = kRanged && digit.first;
    if (kRanged) move_entries(true, from_input ? pairs : uvec2(0), lane, count, row, digit);
    move_entries(false, from_input ? uvec2(0) : pairs, lane, count, row, digit);
}
