// Unit vectors of the features of two images at one pixel, and their weighted difference.

#ifndef SPLAT_FEATURE_DISTANCE_GLSL
#define SPLAT_FEATURE_DISTANCE_GLSL

#include "channels.glsl"
#include "load.glsl"
#include "params/feature_distance_params.h"

QUADS(0, a);
QUADS(1, b);
QUADS(2, weight);
layout(push_constant) uniform Push { FeatureDistanceParams params; };

const float kEps = 1e-10;  // added to norms, as in the published code

// |a| and |b| of pixel i of all images.
vec2 norms(uint i) {
    vec2 squares = vec2(0);
    for (uint c = 0; 4 * c < params.channels; ++c) {
        const vec4 of_a = LD4(a, c * params.images * params.pixels + i);
        const vec4 of_b = LD4(b, c * params.images * params.pixels + i);
        squares += vec2(dot(of_a, of_a), dot(of_b, of_b));
    }
    return sqrt(squares);
}

// Weights of the c-th quad of channels; padding of the last is replaced by zeros.
vec4 weights(uint c) { return channels_below(LD4(weight, c), 4 * c, params.channels); }

// Difference of the unit vectors in the c-th quad of channels.
vec4 difference(uint c, uint i, vec2 lengths) {
    const uint at = c * params.images * params.pixels + i;
    return LD4(a, at) / (lengths.x + kEps) - LD4(b, at) / (lengths.y + kEps);
}

#endif
