#version 460
// Least key and least complement of a key, without keys 0xFFFFFFFF; range [2] starts as ~0. One
// invocation reads one contiguous chunk. Integer minima do not depend on their order.
// Bindings: entries (key, value; read 2 at a time), input_count; range.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
UINT_QUADS(0, entries);
UINTS(1, input_count);
layout(set = 0, binding = 2, std430) buffer Range { uint range[]; };  // accumulates
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

void main() {
    const uint count = min(LD1(input_count, 0), params.capacity);
    const uvec2 quads = lane_quads(gl_GlobalInvocationID.x, count, lanes_for(count));
    uint least = ~0u, least_inverse = ~0u;
    for (uint i = quads.x; i < quads.y; ++i) {
        [[unroll]] for (uint h = 0; h < 2; ++h) {
            const uint at = 2 * i + h;
            const uvec4 two = LDU4(entries, at);
            [[unroll]] for (uint e = 0; e < 2; ++e) {
                const bool stays = 2 * at + e < count && two[2 * e] != ~0u;
                least = min(least, stays ? two[2 * e] : ~0u);
                least_inverse = min(least_inverse, stays ? ~two[2 * e] : ~0u);
            }
        }
    }
    if (quads.x < quads.y) {
        atomicMin(range[0], least);
        atomicMin(range[1], least_inverse);
    }
}
