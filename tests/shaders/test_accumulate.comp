#version 450
// y[i] += x[i]. One invocation computes one element. Specialisation: workgroup size.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"  // makes a module for CPUs, too
#include "params/spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(std430, set = 0, binding = 0) readonly buffer X { float x[]; };
layout(std430, set = 0, binding = 1) buffer Y { float y[]; };
layout(push_constant) uniform Params { uint n; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < n) y[i] += x[i];
}
