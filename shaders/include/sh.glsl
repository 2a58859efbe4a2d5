// Real spherical harmonics up to degree 3: basis, and its derivative with respect to the direction.
// Constants and order: raster_constants.h.

#ifndef SPLAT_SH_GLSL
#define SPLAT_SH_GLSL

#include "raster_constants.h"

// Sets basis[k] for the unit vector d and k < (degree + 1)^2. Other elements stay unchanged.
void sh_basis(uint degree, vec3 d, inout float basis[16]) {
    const float x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    basis[0] = kSh0;
    if (degree < 1) return;
    basis[1] = kSh1y * y;
    basis[2] = kSh1z * z;
    basis[3] = kSh1x * x;
    if (degree < 2) return;
    basis[4] = kSh20 * x * y;
    basis[5] = kSh21 * y * z;
    basis[6] = kSh22 * (2 * zz - xx - yy);
    basis[7] = kSh23 * x * z;
    basis[8] = kSh24 * (xx - yy);
    if (degree < 3) return;
    basis[9] = kSh30 * y * (3 * xx - yy);
    basis[10] = kSh31 * x * y * z;
    basis[11] = kSh32 * y * (4 * zz - xx - yy);
    basis[12] = kSh33 * z * (2 * zz - 3 * xx - 3 * yy);
    basis[13] = kSh34 * x * (4 * zz - xx - yy);
    basis[14] = kSh35 * z * (xx - yy);
    basis[15] = kSh36 * x * (xx - 3 * yy);
}

// Gradient of sum_k weight[k] basis[k] with respect to d, with the components of d independent.
vec3 sh_direction_gradient(uint degree, vec3 d, float weight[16]) {
    const float x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    vec3 g = vec3(0);
    if (degree < 1) return g;
    g += vec3(kSh1x * weight[3], kSh1y * weight[1], kSh1z * weight[2]);
    if (degree < 2) return g;
    g += kSh20 * weight[4] * vec3(y, x, 0);
    g += kSh21 * weight[5] * vec3(0, z, y);
    g += kSh22 * weight[6] * vec3(-2 * x, -2 * y, 4 * z);
    g += kSh23 * weight[7] * vec3(z, 0, x);
    g += kSh24 * weight[8] * vec3(2 * x, -2 * y, 0);
    if (degree < 3) return g;
    g += kSh30 * weight[9] * vec3(6 * x * y, 3 * (xx - yy), 0);
    g += kSh31 * weight[10] * vec3(y * z, x * z, x * y);
    g += kSh32 * weight[11] * vec3(-2 * x * y, 4 * zz - xx - 3 * yy, 8 * y * z);
    g += kSh33 * weight[12] * vec3(-6 * x * z, -6 * y * z, 6 * zz - 3 * xx - 3 * yy);
    g += kSh34 * weight[13] * vec3(4 * zz - 3 * xx - yy, -2 * x * y, 8 * x * z);
    g += kSh35 * weight[14] * vec3(2 * x * z, -2 * y * z, xx - yy);
    g += kSh36 * weight[15] * vec3(3 * (xx - yy), -6 * x * y, 0);
    return g;
}

#endif
