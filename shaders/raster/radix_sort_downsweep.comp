#version 460
// Moves every entry to its place: after the entries of smaller digits, those of its digit in earlier
// lanes, and those of its digit before it in its own lane. Chunks as in radix_sort_upsweep.comp.
// The first pass leaves out keys 0xFFFFFFFF and writes the number of remaining entries to `kept`.
// Bindings: inputs, entries, input_count, kept, table, totals, seconds; entries_out, seconds_out; range.
// Specialisation: kBits: most bits of a digit, kSecond: each entry has a second value, kRanged: digits by the
// range of the keys.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/radix_sort_params.h"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 4;
layout(constant_id = kRadixSortSecondId) const bool kSecond = false;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
UINT_QUADS(0, inputs);
UINT_QUADS(1, entries);
UINT_TABLE(2, input_count);
layout(set = 0, binding = 3, std430) buffer Kept { uint kept[]; };  // accumulates
UINTS(4, table);
UINTS(5, totals);
UINT_QUADS(6, seconds);
PAIRS_OUT(7, entries_out);
layout(set = 0, binding = 8, std430) writeonly buffer SecondsOut { uint seconds_out[]; };
UINT_TABLE(9, range);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"
#include "workgroup.glsl"

uint places[1u << kBits];  // next place of each digit of this lane
shared uint bases[1u << kBits];
shared uint part_sums[kWorkgroupSize];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint lane = gl_WorkGroupID.x * width + l;
    const Digit digit =
        kRanged ? ranged_digit(TABLE1(range, 0), TABLE1(range, 1), kBits) : fixed_digit(kBits);
    uint count = min(TABLE1(input_count, 0), params.capacity);
    if (!digit.first) count = kept[0];
    const uint lanes = lanes_for(count);
    const uint bins = digit.bits > 0 ? 1u << digit.bits : 0u;
    const uint share = (bins + width - 1) / width;
    const uint first_bin = min(l * share, bins), last_bin = min(first_bin + share, bins);
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
    if (digit.first && gl_WorkGroupID.x == 0 && l == width - 1) kept[0] = base;
    barrier();
    for (uint bin = 0; bin < (lane < lanes ? bins : 0); ++bin)
        places[bin] = bases[bin] + LD1(table, lane * bins + bin);

    const uvec2 quads = bins > 0 ? lane_quads(lane, count, lanes) : uvec2(0);
    for (uint i = quads.x; i < quads.y; ++i) {
        const uvec4 second = kSecond ? LDU4(seconds, i) : uvec4(0);
        [[unroll]] for (uint h = 0; h < 2; ++h) {
            const uint at = 2 * i + h;
            const uvec4 two = digit.first ? LDU4(inputs, at) : LDU4(entries, at);
            [[unroll]] for (uint e = 0; e < 2; ++e) {
                const uint key = two[2 * e];
                if (2 * at + e < count && key != 0xFFFFFFFFu) {
                    const uint bin = digit_of(key, digit);
                    const uint place = places[bin];
                    places[bin] = place + 1;
                    ST2(entries_out, place, uvec2(key, two[2 * e + 1]));
                    if (kSecond) seconds_out[place] = second[2 * h + e];
                }
            }
        }
    }
}
