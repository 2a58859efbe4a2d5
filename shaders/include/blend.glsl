// Shared by the blending passes. Both compute alpha with the same expression, in tile coordinates, so that
// no pixel crosses a threshold in one pass only.

#ifndef SPLAT_BLEND_GLSL
#define SPLAT_BLEND_GLSL

#include "params/blend_params.h"
#include "raster_constants.h"

// d/dq of |L^T q|^2 in natural units: sigma = ln(2) |L^T q|^2, and the derivative of a square gives 2.
const float kTwoLn2 = 1.38629436112;

// -|L^T q|^2 of the pixel centre `at`; never positive.
float log2_weight(vec2 mean, vec3 l, vec2 at) {
    precise float qx = mean.x - at.x, qy = mean.y - at.y;
    precise float u = l.x * qx + l.y * qy;
    precise float v = l.z * qy;
    precise float power = -(u * u + v * v);
    return power;
}

#endif
