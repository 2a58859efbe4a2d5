#version 450
// y[i] = 1 if x[i] * factor is finite, else 0. One invocation computes one element.
// Specialisation: workgroup size.
#extension GL_GOOGLE_include_directive : require
#include "finite.glsl"
#include "params/spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(std430, set = 0, binding = 0) readonly buffer X { float x[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Y { float y[]; };
layout(push_constant) uniform Params { uint n; float factor; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < n) y[i] = finite(x[i] * factor) ? 1 : 0;
}
