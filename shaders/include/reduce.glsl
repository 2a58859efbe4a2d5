// Sums over a workgroup of a power of two, in a fixed order: the same bits on every run.
// Every invocation must call; all receive the sum.

#ifndef SPLAT_REDUCE_GLSL
#define SPLAT_REDUCE_GLSL

#include "workgroup.glsl"

const uint kLog2MaxWorkgroup = 10;

shared vec4 reduce_scratch[kWorkgroupSize];

vec4 workgroup_sum(vec4 value) {
    const uint lane = gl_LocalInvocationID.x;
    barrier();  // the previous call's scratch may still be read
    reduce_scratch[lane] = value;
    // A constant length lets drivers unroll it: lavapipe limits a loop's turns (src/vk/launch.h).
    for (uint step = 1; step <= kLog2MaxWorkgroup; ++step) {
        const uint width = gl_WorkGroupSize.x >> step;
        if (width == 0) continue;
        barrier();
        if (lane < width) reduce_scratch[lane] += reduce_scratch[lane + width];
    }
    barrier();
    return reduce_scratch[0];
}

float workgroup_sum(float value) { return workgroup_sum(vec4(value, 0, 0, 0)).x; }
vec2 workgroup_sum(vec2 value) { return workgroup_sum(vec4(value, 0, 0)).xy; }

#endif
