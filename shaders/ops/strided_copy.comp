#version 460
// y[i * out_stride + out_offset + c] = x[i * in_stride + in_offset + c] for c < channels; or += if
// kAccumulate is set. Channels are a constant, because lavapipe divides vectors of integers one by one.
// One invocation copies one float. Bindings: x, y, both arrays of float.
// Specialisation: kChannels, kAccumulate: add to y.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/strided_copy_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kStridedCopyChannelsId) const uint kChannels = 1;
layout(constant_id = kStridedCopyAccumulateId) const bool kAccumulate = false;
UINTS(0, x);
layout(set = 0, binding = 1, std430) buffer Y { float y[]; };  // accumulates
layout(push_constant) uniform Push { StridedCopyParams params; };

#include "launch.glsl"

void main() {
    const uint index = invocation_index(params.groups_x);
    if (index >= (params.count - params.begin) * kChannels) return;
    const uint element = index / kChannels;
    const uint i = params.begin + element;
    const uint c = index - element * kChannels;
    const uint to = i * params.out_stride + params.out_offset + c;
    const float value = uintBitsToFloat(LD1(x, i * params.in_stride + params.in_offset + c));
    y[to] = kAccumulate ? y[to] + value : value;
}
