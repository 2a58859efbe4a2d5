#version 460
// Moves every entry to its place: the entries of smaller digits, then those of the same digit in
// lanes before, then those before it in its own lane. Chunks as in radix_sort_upsweep.comp.
// The first pass leaves out keys 0xFFFFFFFF; the number of entries that stay goes to `kept`. A pass
// with nothing left to sort by copies.
// Bindings: keys, values, seconds, entries, table, totals; keys_out, values_out, seconds_out, kept;
// range. Specialisation: 10 = most bits of a digit, 11 = values are the entries' positions, 12 = each
// entry has a second value, 13 = first pass, 14 = keys are not wanted, 15 = digits by the range.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/radix_sort_params.h"
#include "lane_quads.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kBits = 4;
layout(constant_id = 11) const bool kPositions = false;
layout(constant_id = 12) const bool kSecond = false;
layout(constant_id = 13) const bool kFirst = false;
layout(constant_id = 14) const bool kNoKeys = false;
layout(constant_id = 15) const bool kRanged = false;
UINT_QUADS(0, keys);
UINT_QUADS(1, values);
UINT_QUADS(2, seconds);
UINTS(3, entries);
UINTS(4, table);
UINTS(5, totals);
layout(set = 0, binding = 6, std430) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 7, std430) writeonly buffer ValuesOut { uint values_out[]; };
layout(set = 0, binding = 8, std430) writeonly buffer SecondsOut { uint seconds_out[]; };
layout(set = 0, binding = 9, std430) writeonly buffer Kept { uint kept[]; };
UINTS(10, range);
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

shared uint column[gl_WorkGroupSize.x << kBits];
shared uint bases[1u << kBits];
shared uint part_sums[gl_WorkGroupSize.x];

void move(uint place, uint key, uint value, uint second) {
    if (!kNoKeys) keys_out[place] = key;
    values_out[place] = value;
    if (kSecond) seconds_out[place] = second;
}

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const uint lane = gl_WorkGroupID.x * width + l;
    const uint count = min(LD1(entries, 0), params.capacity), lanes = lanes_for(count);
    Digit digit = Digit(0, params.shift, kBits);
    if (kRanged) digit = ranged_digit(LD1(range, 0), LD1(range, 1), kBits);
    const bool stay = digit.bits == 0;
    const uint bins = 1u << digit.bits;
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
    if (gl_WorkGroupID.x == 0 && l == width - 1) kept[0] = base;
    barrier();
    for (uint bin = 0; bin < (lane < lanes && !stay ? bins : 0); ++bin)
        column[bin * width + l] = bases[bin] + LD1(table, lane * bins + bin);

    const uvec2 quads = lane_quads(lane, count, lanes);
    for (uint i = stay ? quads.x : quads.y; i < quads.y; ++i) {
        const uvec4 key = LDU4(keys, i);
        const uvec4 value = LDU4(values, i);
        const uvec4 second = kSecond ? LDU4(seconds, i) : uvec4(0);
        [[unroll]] for (uint e = 0; e < 4; ++e)
            if (4 * i + e < count) move(4 * i + e, key[e], value[e], second[e]);
    }
    for (uint i = stay ? quads.y : quads.x; i < quads.y; ++i) {
        const uvec4 key = LDU4(keys, i);
        const uvec4 value = kPositions ? 4 * i + uvec4(0, 1, 2, 3) : LDU4(values, i);
        const uvec4 second = kSecond ? LDU4(seconds, i) : uvec4(0);
        [[unroll]] for (uint e = 0; e < 4; ++e) {
            if (4 * i + e < count && (!kFirst || key[e] != 0xFFFFFFFFu)) {
                const uint at = digit_of(key[e], digit) * width + l;
                const uint place = column[at];
                column[at] = place + 1;
                move(place, key[e], value[e], second[e]);
            }
        }
    }
}
