#version 460
// Like radix_sort_range.comp, for GPUs: a workgroup, not an invocation, reads a contiguous chunk, in order of its
// invocations. Bindings as there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Entries { uvec2 entries[]; };
layout(set = 0, binding = 1, std430) readonly buffer InputCount { uint input_count[]; };
layout(set = 0, binding = 2, std430) buffer Range { uint range[]; };  // accumulates
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

shared uint least[2];

void main() {
    const uint l = gl_LocalInvocationID.x;
    if (l < 2) least[l] = ~0u;
    barrier();
    const uint count = min(input_count[0], params.capacity);
    const uvec2 chunk = 4 * lane_quads(gl_WorkGroupID.x, count, params.lanes);
    uvec2 own = uvec2(~0u);
    for (uint i = chunk.x + l; i < min(chunk.y, count); i += gl_WorkGroupSize.x) {
        const uint key = entries[i].x;
        if (key != ~0u) own = min(own, uvec2(key, ~key));
    }
    atomicMin(least[0], own.x);
    atomicMin(least[1], own.y);
    barrier();
    if (l < 2 && chunk.x < chunk.y) atomicMin(range[l], least[l]);
}
