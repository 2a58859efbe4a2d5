#version 450
// y[group] = a number that takes `rounds` dependent steps to find; also the index of the group in
// the whole dispatch, in the low bits. One invocation per workgroup. Specialisation: workgroup
// size.
#extension GL_GOOGLE_include_directive : require
#include "params/spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(std430, set = 0, binding = 0) writeonly buffer Y { uint y[]; };
layout(push_constant) uniform Params { uint width; uint rounds; };

void main() {
    uint group = gl_WorkGroupID.y * width + gl_WorkGroupID.x;
    uint state = group + 1u;
    for (uint i = 0u; i < rounds; ++i) state = state * 1664525u + 1013904223u;
    if (gl_LocalInvocationIndex == 0u) y[group] = (state & 0xFFFF0000u) | group;
}
