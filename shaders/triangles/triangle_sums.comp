#version 460
// One level of sums: each run of 64 elements becomes its inclusive sums, whose last is an element of the next level.
// One invocation sums one run.
// Bindings: sums, all levels, in place.
#extension GL_GOOGLE_include_directive : require
#include "params/triangles/triangle_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) buffer Sums { uint sums[]; };  // accumulates
layout(push_constant) uniform Push { TriangleSumsParams params; };

#include "launch.glsl"

void main() {
    const uint run = invocation_index(params.groups_x);
    const uint first = run << kSumsBits;
    if (first >= params.count) return;
    const uint last = min(first + (1u << kSumsBits), params.count);
    uint sum = 0;
    for (uint i = first; i < last; ++i) {
        sum += sums[params.begin + i];
        sums[params.begin + i] = sum;
    }
    sums[params.next + run] = sum;
}
