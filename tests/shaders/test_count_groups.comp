#version 450
// y[0] = number of workgroups: such a shader must not be split. Specialisation: workgroup size.
#extension GL_GOOGLE_include_directive : require
#include "params/spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(std430, set = 0, binding = 0) writeonly buffer Y { uint y[]; };

void main() {
    if (gl_GlobalInvocationID.x == 0u) y[0] = gl_NumWorkGroups.x;
}
