#version 450
// y[i] = factor * x[i] + offset. One invocation computes one element.
// Specialisation: 0 workgroup size, 10 offset.
layout(local_size_x_id = 0) in;
layout(constant_id = 10) const float kOffset = 0.0;
layout(std430, set = 0, binding = 0) readonly buffer X { float x[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Y { float y[]; };
layout(push_constant) uniform Params { uint n; float factor; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < n) y[i] = factor * x[i] + kOffset;
}
