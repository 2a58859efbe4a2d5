#version 460
// partial = sum over the channels of weight * (a / (|a| + eps) - b / (|b| + eps))^2 at each pixel;
// feature_distance_forward_sum averages them over the pixels. One invocation computes one pixel.
// Bindings: a, b (quads), weight [channels], partial [images, pixels].
#extension GL_GOOGLE_include_directive : require
#include "params/feature_distance_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "feature_distance.glsl"
layout(set = 0, binding = 3, std430) writeonly buffer Partial { float partial[]; };
#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.images * params.pixels) return;
    const vec2 lengths = norms(i);
    float sum = 0;
    for (uint c = 0; 4 * c < params.channels; ++c) {
        const vec4 d = difference(c, i, lengths);
        sum += dot(weights(c), d * d);
    }
    partial[i] = sum;
}
