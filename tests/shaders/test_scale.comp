#version 450
// y[i] = factor * x[i] + offset. One invocation computes one element.
// Specialisation: workgroup size, kOffset.
#extension GL_GOOGLE_include_directive : require
#include "test_spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTestOffsetId) const float kOffset = 0.0;
layout(std430, set = 0, binding = 0) readonly buffer X { float x[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Y { float y[]; };
layout(push_constant) uniform Params { uint n; float factor; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < n) y[i] = factor * x[i] + kOffset;
}
