#version 460
// Must be refused: the length of an array is gl_WorkGroupSize.
layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0, std430) buffer X { float x[]; };
shared float values[2 * gl_WorkGroupSize.x];
void main() {
    values[gl_LocalInvocationID.x] = x[gl_LocalInvocationID.x];
    barrier();
    x[gl_LocalInvocationID.x] = values[gl_WorkGroupSize.x - 1 - gl_LocalInvocationID.x];
}
