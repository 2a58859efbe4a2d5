#version 460
// Exclusive sums over the lanes of the table of radix_sort_upsweep.comp, for each bin, and the bins'
// totals. One invocation computes one bin. Bindings: table [lanes][bins] in place, totals [bins], input_count,
// kept, range. Specialisation: kBits: most bits of a digit, kRanged: digits by the range of the keys.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 4;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
layout(set = 0, binding = 0, std430) buffer Table { uint table[]; };  // accumulates
layout(set = 0, binding = 1, std430) writeonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 2, std430) readonly buffer InputCount { uint input_count[]; };
layout(set = 0, binding = 3, std430) readonly buffer Kept { uint kept[]; };
layout(set = 0, binding = 4, std430) readonly buffer Range { uint range[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

void main() {
    const uint bin = gl_GlobalInvocationID.x;
    const Digit digit = kRanged ? ranged_digit(range[0], range[1], kBits) : fixed_digit(kBits);
    const uint bins = 1u << digit.bits;
    if (digit.bits == 0 || bin >= bins) return;
    const uint lanes = lanes_for(digit.first ? min(input_count[0], params.capacity) : kept[0]);
    uint before = 0;
    for (uint lane = 0; lane < lanes; ++lane) {
        const uint count = table[lane * bins + bin];
        table[lane * bins + bin] = before;
        before += count;
    }
    totals[bin] = before;
}
