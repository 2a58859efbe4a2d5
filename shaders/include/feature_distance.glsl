// Unit vectors of the features of two images at one pixel, and their weighted difference.

#ifndef SPLAT_FEATURE_DISTANCE_GLSL
#define SPLAT_FEATURE_DISTANCE_GLSL

#include "channels.glsl"
#include "keep_nan.glsl"
#include "load.glsl"
#include "params/feature_distance_params.h"

QUADS(0, a);
QUADS(1, b);
QUADS(2, weight);
layout(push_constant) uniform Push { FeatureDistanceParams params; };

const float kEps = 1e-10;  // added to norms, as in the published code

// Squares of |a| and |b| of pixel i of all images, each after a product with its factor.
vec2 squared_norms(uint i, vec2 factors) {
    vec2 squares = vec2(0);
    for (uint c = 0; 4 * c < params.channels; ++c) {
        const vec4 of_a = factors.x * LD4(a, c * params.images * params.pixels + i);
        const vec4 of_b = factors.y * LD4(b, c * params.images * params.pixels + i);
        squares += vec2(dot(of_a, of_a), dot(of_b, of_b));
    }
    return squares;
}

// |a| and |b| of pixel i of all images, also where squares overflow or vanish.
vec2 norms(uint i) {
    const vec2 squares = squared_norms(i, vec2(1));
    const bvec2 vanish = lessThan(squares, vec2(1e-28));
    const bvec2 overflow = greaterThan(squares, vec2(1e37));
    if (!any(vanish) && !any(overflow)) return sqrt(squares);
    // 2^-80 and 2^100
    const vec2 factors = mix(mix(vec2(1), vec2(8.2718061e-25), overflow), vec2(1.2676506e30), vanish);
    return sqrt(squared_norms(i, factors)) / factors;
}

// Weights of the c-th quad of channels; padding of the last is replaced by zeros.
vec4 weights(uint c) { return channels_below(LD4(weight, c), 4 * c, params.channels); }

// Difference of the unit vectors in the c-th quad of channels.
vec4 difference(uint c, uint i, vec2 lengths) {
    const uint at = c * params.images * params.pixels + i;
    return LD4(a, at) / (lengths.x + kEps) - LD4(b, at) / (lengths.y + kEps);
}

#endif
