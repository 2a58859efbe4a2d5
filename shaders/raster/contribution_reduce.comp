#version 460
// Sums each Gaussian's records of weights and pixels over all views, in their fixed order. One invocation
// computes one Gaussian.
// Bindings: counts [V*N], begins [V*N], record_d [pairs] vec2 of blend_backward.comp; contributions [N] vec2
// (sum of the weights, number of pixels that see it).
#extension GL_GOOGLE_include_directive : require
#include "params/raster_reduce_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, std430) readonly buffer Begins { uint begins[]; };
layout(set = 0, binding = 2, std430) readonly buffer RecordD { vec2 record_d[]; };
layout(set = 0, binding = 3, std430) buffer Contributions { vec2 contributions[]; };  // accumulates
layout(push_constant) uniform Push { ContributionReduceParams params; };

#include "launch.glsl"

void main() {
    const uint index = invocation_index(params.groups_x);
    if (index >= params.gaussians) return;
    vec2 sum = params.accumulate != 0 ? contributions[index] : vec2(0);
    for (uint view = 0; view < params.views; ++view) {
        const uint item = view * params.gaussians + index;
        const uint begin = begins[item], end = begin + counts[item];
        for (uint i = begin; i < end; ++i) sum += record_d[i];
    }
    contributions[index] = sum;
}
