#version 450
// y[index] = 1, where index may lie outside the buffer: bait for GPU-assisted validation.
layout(local_size_x = 1) in;
layout(std430, set = 0, binding = 0) writeonly buffer Y { uint y[]; };
layout(push_constant) uniform Params { uint index; };

void main() { y[index] = 1u; }
