#version 450
// y[0] = number of workgroups: such a shader must not be split. Specialisation: 0 workgroup size.
layout(local_size_x_id = 0) in;
layout(std430, set = 0, binding = 0) writeonly buffer Y { uint y[]; };

void main() {
    if (gl_GlobalInvocationID.x == 0u) y[0] = gl_NumWorkGroups.x;
}
