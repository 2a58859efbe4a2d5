// Shared by the kernels of the photograph's loss: a pixel of the truth is R | G << 8 | B << 16 | A << 24, and counts if
// A is 255. Elsewhere image and truth are 0, whatever the image holds.

#ifndef SPLAT_PHOTO_LOSS_GLSL
#define SPLAT_PHOTO_LOSS_GLSL

#include "params/fit_params.h"
#include "losses/similarity.glsl"

layout(push_constant) uniform Push { PhotoLossParams dims; };
layout(constant_id = kPhotoLossExposureId) const uint kExposure = 0;

bool counts(uint word) { return word >> 24 == 255u; }

vec4 color_of(uint word) { return vec4(word & 255u, word >> 8 & 255u, word >> 16 & 255u, 0) * (1.0 / 255.0); }

// The gains of the exposure, and a colour of the image as the exposure shows it.
mat3 gains() {
    return mat3(dims.exposure[0], dims.exposure[4], dims.exposure[8], dims.exposure[1], dims.exposure[5],
                dims.exposure[9], dims.exposure[2], dims.exposure[6], dims.exposure[10]);
}
vec3 exposed(vec3 color) {
    if (kExposure == 0) return color;
    return gains() * color + vec3(dims.exposure[3], dims.exposure[7], dims.exposure[11]);
}

// The means of p, p^2, q and q^2 where all is zero.
const vec4 kOutside[4] = vec4[4](vec4(-kPivot), vec4(kPivot * kPivot), vec4(0), vec4(0));

// The window over the eleven elements of an array from `at` on.
#define WINDOW(v, at) \
    (kWindow[5] * v[at + 5] + kWindow[4] * (v[at + 4] + v[at + 6]) + kWindow[3] * (v[at + 3] + v[at + 7]) + \
     kWindow[2] * (v[at + 2] + v[at + 8]) + kWindow[1] * (v[at + 1] + v[at + 9]) + kWindow[0] * (v[at] + v[at + 10]))

#endif
