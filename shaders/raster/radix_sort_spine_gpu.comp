#version 460
// Like radix_sort_spine.comp, for GPUs: a workgroup sums a row of the table, which is of one bin.
// Bindings and specialisation as there; table [bins][lanes] in quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/radix_sort_params.h"
#include "raster/scan.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 8;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
layout(set = 0, binding = 0, std430) buffer Table { uvec4 table[]; };  // accumulates
layout(set = 0, binding = 1, std430) writeonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 2, std430) readonly buffer InputCount { uint input_count[]; };
layout(set = 0, binding = 3, std430) readonly buffer Kept { uint kept[]; };
layout(set = 0, binding = 4, std430) readonly buffer Range { uint range[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

void main() {
    const uint l = gl_LocalInvocationID.x, bin = gl_WorkGroupID.x;
    const Digit digit = kRanged ? ranged_digit(range[0], range[1], kBits) : fixed_digit(kBits);
    if (digit.bits == 0 || bin >= 1u << digit.bits) return;
    const uint row = params.lanes / 4;
    uint total = 0;
    for (uint first = l; first - l < row; first += 4 * kWorkgroupSize) {
        uvec4 quads[4];
        [[unroll]] for (uint k = 0; k < 4; ++k) {
            const uint at = first + k * kWorkgroupSize;
            quads[k] = at < row ? table[bin * row + at] : uvec4(0);
        }
        scan_quads(quads, total);
        [[unroll]] for (uint k = 0; k < 4; ++k) {
            const uint at = first + k * kWorkgroupSize;
            if (at < row) table[bin * row + at] = quads[k];
        }
    }
    if (l == 0) totals[bin] = total;
}
