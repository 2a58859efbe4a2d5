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

// Opacity at a pixel, not limited. cut: a Gaussian ends at 3 sigma.
float density(float opacity, float power, bool cut) {
    precise float raw = opacity * exp2(power);
    return cut && power < -kCutReach ? 0.0 : raw;
}

// A workgroup that walked a list of any length might run for seconds, and no device splits it. So one dispatch walks
// the lists of at most `most` entries whole, and each further one `most` entries of the others, from entry `begin` on
// (in_parts), forward from the first to the last, backward from the last to the first. What a pixel carries from part
// to part lies in its outputs, as if the walk had not been interrupted: no part changes a bit.
// Returns false if this dispatch leaves the list out. part: the entries that it walks, if not in_parts none then.
bool walks(bool in_parts, uvec2 list, uint begin, uint most, out uvec2 part) {
    const uint length = list.y - list.x;
    part = in_parts ? uvec2(list.x + begin, min(list.y, list.x + begin + most))
                    : uvec2(list.x, length <= most ? list.y : list.x);
    return in_parts ? length > max(begin, most) : length <= most;
}

// The item that Gaussian 0 has or would have in a view. Of its `size`, z and w are 0, or with ranges the first Gaussian
// less the items before (src/raster/pack_camera.h).
uint item_of_first(uint view, uint gaussians, vec4 size) {
    return view * gaussians - uint(int(size.z) * 4096 + int(size.w));
}

// The log2 weight of a Gaussian at the maximum along a pixel's ray, and its depth; if that is before `near`, a weight
// that no opacity makes visible. Equations: raster/ray_form.glsl. q: mean less pixel centre; l, e: of the ray form; z:
// depth of the mean.
float ray_maximum(vec2 q, vec4 l, vec4 e, float z, float near, out float depth) {
    precise float u = l.x * q.x + l.y * q.y;
    precise float v = l.z * q.y;
    precise float e1 = e.x - (e.z * q.x + e.w * q.y);
    precise float e2 = e.y - l.w * q.y;
    precise float part = 1.0 / (e1 * e1 + e2 * e2 + 1.0);
    precise float power = -(u * u + v * v) * part;
    precise float at = z * (e1 * e.x + e2 * e.y + 1.0) * part;
    depth = at;
    return depth > near ? power : -1e6;
}

float log2_weight(vec2 mean, vec3 l, vec2 at) { return log2_weight(whitened_offset(mean, l, at)); }

#endif
