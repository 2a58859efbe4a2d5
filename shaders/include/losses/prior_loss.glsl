// Shared by the kernels of the losses against maps: what is drawn at a pixel, and what its map says.
// A pixel of a map is a uvec2: relative inverse depth p as a float, and (n + 1) / 2 in bytes under two flags.

#ifndef SPLAT_PRIOR_LOSS_GLSL
#define SPLAT_PRIOR_LOSS_GLSL

#include "keep_nan.glsl"
#include "params/fit_params.h"

layout(push_constant) uniform Push { PriorLossParams dims; };

const float kLeastAlpha = 0.5;  // fainter pixels have no depth

bool has_depth(uvec2 word) { return (word.y >> 24 & 1u) != 0u; }
bool has_normal(uvec2 word) { return (word.y >> 24 & 2u) != 0u; }

vec3 normal_of(uvec2 word) {
    const uvec3 bytes = uvec3(word.y, word.y >> 8, word.y >> 16) & 255u;
    return normalize(vec3(bytes) * (1.0 / 127.5) - 1.0);
}

// The ray of a pixel, whose z is 1.
vec3 ray_of(uint i) {
    const vec2 at = vec2(i % dims.width, i / dims.width) + 0.5;
    return vec3((at - vec2(dims.cx, dims.cy)) / vec2(dims.fx, dims.fy), 1);
}

#endif
