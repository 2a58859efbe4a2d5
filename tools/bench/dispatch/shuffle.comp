// 64 shuffles with an addition each a turn and invocation, 8 of them in flight.
#version 450
#extension GL_KHR_shader_subgroup_shuffle : require
layout(local_size_x = 256) in;
layout(push_constant) uniform Push { uint turns; float factor; float term; };
layout(std430, binding = 0) buffer Out { float values[]; };

void main() {
    float sums[8];
    for (int i = 0; i < 8; ++i) sums[i] = float(gl_LocalInvocationIndex + i);
    for (uint turn = 0; turn < turns; ++turn)
        for (int step = 0; step < 8; ++step)
            for (int i = 0; i < 8; ++i) sums[i] = subgroupShuffleXor(sums[i], 1u << (step & 1)) + term;
    float sum = 0;
    for (int i = 0; i < 8; ++i) sum += sums[i];
    if (sum == -1.0) values[gl_GlobalInvocationID.x] = sum;  // never, but the compiler does not know
}
