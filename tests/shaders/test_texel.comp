#version 450
// y[i] = x[i] + x[i], in quads, read through a texel buffer. One invocation computes one quad.
// Specialisation: workgroup size.
#extension GL_GOOGLE_include_directive : require
#include "params/spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0) uniform samplerBuffer x;
layout(std430, set = 0, binding = 1) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Params { uint quads; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < quads) y[i] = 2.0 * texelFetch(x, int(i));
}
