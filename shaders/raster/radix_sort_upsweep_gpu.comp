#version 460
// Like radix_sort_upsweep.comp, for GPUs: a workgroup, not a lane, owns a contiguous chunk, reads it in
// order of its invocations and counts with atomics in shared memory. table [bins][workgroups].
// Bindings and specialisation as there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 8;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { uvec2 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Entries { uvec2 entries[]; };
layout(set = 0, binding = 2, std430) readonly buffer InputCount { uint input_count[]; };
layout(set = 0, binding = 3, std430) readonly buffer Kept { uint kept[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Table { uint table[]; };
layout(set = 0, binding = 5, std430) readonly buffer Range { uint range[]; };
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

shared uint counters[1u << kBits];

void main() {
    const uint l = gl_LocalInvocationID.x, width = gl_WorkGroupSize.x;
    const Digit digit = kRanged ? ranged_digit(range[0], range[1], kBits) : fixed_digit(kBits);
    if (digit.bits == 0) return;
    const uint bins = 1u << digit.bits;
    for (uint bin = l; bin < bins; bin += width) counters[bin] = 0;
    barrier();
    const uint count = digit.first ? min(input_count[0], params.capacity) : kept[0];
    const uvec2 chunk = 4 * lane_quads(gl_WorkGroupID.x, count, params.lanes);
    for (uint i = chunk.x + l; i < min(chunk.y, count); i += width) {
        const uint key = digit.first ? inputs[i].x : entries[i].x;
        if (key != 0xFFFFFFFFu) atomicAdd(counters[digit_of(key, digit)], 1u);
    }
    barrier();
    for (uint bin = l; bin < bins; bin += width) table[bin * params.lanes + gl_WorkGroupID.x] = counters[bin];
}
