#version 460
// grad_a = grad_y / pixels * (u / (|a| + eps) - a (u . a) / (|a| (|a| + eps)^2)), u = 2 weight * the
// difference of the unit vectors; 0 where a is 0. One invocation computes one pixel.
// Bindings: a, b (quads), weight [channels], grad_y (quads of one channel), grad_a (quads).
#extension GL_GOOGLE_include_directive : require
#include "params/feature_distance_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "feature_distance.glsl"
#include "store.glsl"
QUADS(3, grad_y);
QUADS_OUT(4, grad_a);
#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.images * params.pixels) return;
    const vec2 lengths = norms(i);
    const uint step = params.images * params.pixels;
    float along = 0;  // u . a
    for (uint c = 0; 4 * c < params.channels; ++c)
        along += dot(2 * weights(c) * difference(c, i, lengths), LD4(a, c * step + i));
    const bool zero = lengths.x == 0;
    const float inverse = 1 / (lengths.x + kEps);
    const float back = along * inverse * inverse;  // gradient through the unit vector
    const float scale = zero ? 0.0 : LD4(grad_y, i / params.pixels).x * params.scale;
    for (uint c = 0; 4 * c < params.channels; ++c) {
        const vec4 u = 2 * weights(c) * difference(c, i, lengths);
        const vec4 unit = zero ? vec4(0) : LD4(a, c * step + i) / lengths.x;
        ST4(grad_a, c * step + i, scale * (u * inverse - unit * back));
    }
}
