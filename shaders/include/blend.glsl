// Shared by the blending passes. Both compute alpha with the same expression, in tile coordinates, so that
// no pixel crosses a threshold in one pass only.

#ifndef SPLAT_BLEND_GLSL
#define SPLAT_BLEND_GLSL

#include "params/blend_params.h"
#include "raster_constants.h"

// d/dq of |L^T q|^2 in natural units: sigma = ln(2) |L^T q|^2, and the derivative of a square gives 2.
const float kTwoLn2 = 1.38629436112;

// L^T q of the pixel centre `at`, q = mean - at.
vec2 whitened_offset(vec2 mean, vec3 l, vec2 at) {
    precise float qx = mean.x - at.x, qy = mean.y - at.y;
    precise float u = l.x * qx + l.y * qy;
    precise float v = l.z * qy;
    return vec2(u, v);
}

// -|L^T q|^2; never positive.
float log2_weight(vec2 y) {
    precise float power = -(y.x * y.x + y.y * y.y);
    return power;
}

float log2_weight(vec2 mean, vec3 l, vec2 at) { return log2_weight(whitened_offset(mean, l, at)); }

#endif
