// One vec4 an invocation, from one buffer to another.
#version 450
layout(local_size_x = 256) in;
layout(push_constant) uniform Push { uint count; uint groups_x; };
layout(std430, binding = 0) writeonly buffer To { vec4 to[]; };
layout(std430, binding = 1) readonly buffer From { vec4 from[]; };

void main() {
    const uint group = gl_WorkGroupID.y * groups_x + gl_WorkGroupID.x;
    const uint i = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    if (i < count) to[i] = from[i];
}
