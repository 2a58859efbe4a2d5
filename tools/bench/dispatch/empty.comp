// Nothing: what a dispatch costs by itself. The constant makes two pipelines of different code.
#version 450
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint kVariant = 0;
layout(push_constant) uniform Push { uint never; };
layout(std430, binding = 0) buffer Out { uint values[]; };

void main() {
    if (never == 1) values[gl_GlobalInvocationID.x] = kVariant;
}
