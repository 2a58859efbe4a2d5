#version 460
// Sums each Gaussian's records of weights and pixels over all views, in their fixed order. One invocation
// computes one Gaussian.
// Bindings: counts [V*N] and, from params.begins, first records; records of blend_backward as vec2; contributions
// [N] vec2 (sum of the weights, number of pixels that see it).
#extension GL_GOOGLE_include_directive : require
#include "params/raster_reduce_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, std430) readonly buffer Records { vec2 records[]; };
layout(set = 0, binding = 2, std430) buffer Contributions { vec2 contributions[]; };  // accumulates
layout(push_constant) uniform Push { ContributionReduceParams params; };

#include "launch.glsl"

void main() {
    const uint index = invocation_index(params.groups_x);
    if (index >= params.gaussians) return;
    vec2 sum = params.accumulate != 0 ? contributions[index] : vec2(0);
    for (uint view = 0; view < params.views; ++view) {
        const uint item = view * params.gaussians + index;
        const uint begin = counts[params.begins + item], end = begin + counts[item];
        for (uint i = begin; i < end; ++i) sum += records[i * params.stride + params.first];
    }
    contributions[index] = sum;
}
