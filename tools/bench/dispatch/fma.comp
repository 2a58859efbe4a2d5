// 512 independent multiply-adds a turn and invocation, 32 of them in flight.
#version 450
layout(local_size_x = 256) in;
layout(push_constant) uniform Push { uint turns; float factor; float term; };
layout(std430, binding = 0) buffer Out { float values[]; };

void main() {
    vec4 sums[8];
    for (int i = 0; i < 8; ++i) sums[i] = vec4(float(gl_LocalInvocationIndex + i));
    for (uint turn = 0; turn < turns; ++turn)
        for (int step = 0; step < 16; ++step)
            for (int i = 0; i < 8; ++i) sums[i] = sums[i] * factor + term;
    vec4 total = vec4(0);
    for (int i = 0; i < 8; ++i) total += sums[i];
    const float sum = total.x + total.y + total.z + total.w;
    if (sum == -1.0) values[gl_GlobalInvocationID.x] = sum;  // never, but the compiler does not know
}
