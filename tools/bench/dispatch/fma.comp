// 64 multiply-adds a turn, invocation and vector; all vectors are in flight.
#version 450
layout(local_size_x = 256) in;
layout(constant_id = 0) const uint kVectors = 8;
layout(push_constant) uniform Push { uint turns; float factor; float term; };
layout(std430, binding = 0) buffer Out { float values[]; };

void main() {
    vec4 sums[kVectors];
    for (int i = 0; i < kVectors; ++i) sums[i] = vec4(float(gl_LocalInvocationIndex + i));
    for (uint turn = 0; turn < turns; ++turn)
        for (int step = 0; step < 16; ++step)
            for (int i = 0; i < kVectors; ++i) sums[i] = sums[i] * factor + term;
    vec4 total = vec4(0);
    for (int i = 0; i < kVectors; ++i) total += sums[i];
    const float sum = total.x + total.y + total.z + total.w;
    if (sum == -1.0) values[gl_GlobalInvocationID.x] = sum;  // never, but the compiler does not know
}
