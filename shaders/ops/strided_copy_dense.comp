#version 460
// Like strided_copy.comp, for y without gaps: out_stride = channels, out_offset = 0, begin = 0 and count a
// multiple of 4. One invocation copies four floats, because lavapipe stores a vec4 at little more than the cost of a
// float. Bindings: x array of float, y array of vec4.
// Specialisation as strided_copy.comp.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/strided_copy_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kStridedCopyChannelsId) const uint kChannels = 1;
layout(constant_id = kStridedCopyAccumulateId) const bool kAccumulate = false;
UINTS(0, x);
layout(set = 0, binding = 1, std430) buffer Y { vec4 y[]; };  // accumulates
layout(push_constant) uniform Push { StridedCopyParams params; };

#include "launch.glsl"

void main() {
    const uint quad = invocation_index(params.groups_x);
    if (quad >= params.count / 4 * kChannels) return;
    const uint i = 4 * quad / kChannels;
    uint c = 4 * quad - i * kChannels;
    uint from = i * params.in_stride + params.in_offset + c;
    vec4 value;
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        value[k] = uintBitsToFloat(LD1(x, from));
        ++c;
        const bool next = c == kChannels;
        from += next ? params.in_stride - kChannels + 1 : 1;
        c = next ? 0 : c;
    }
    y[quad] = kAccumulate ? y[quad] + value : value;
}
