// What both passes of gaussian_head share: where a pixel's channels are, and its ray.
// Needs `params` (GaussianHeadParams), the specialisation constants kOffset and kDegree, and the buffers
// rays, view_to_world, focal.

#ifndef SPLAT_GAUSSIAN_HEAD_GLSL
#define SPLAT_GAUSSIAN_HEAD_GLSL

// Channels behind the depth, which is channel 0; the offset, if any, is 1 to 3.
const uint kOpacityAt = kOffset != 0 ? 4 : 1;
const uint kScalesAt = kOpacityAt + 1;
const uint kRotationAt = kOpacityAt + 4;
const uint kShAt = kOpacityAt + 8;
const uint kShCoefficients = kDegree == 0 ? 1 : 4;
const float kMinNorm = 1e-12;
const float kMinW = 1e-10;

// Channel c of pixel i of all images, in floats.
uint place(uint c, uint i) { return (c / 4 * params.images * params.pixels + i) * 4 + c % 4; }

// For row vectors: p * M.
mat4 row_matrix(uint image) {
    mat4 m;
    for (uint j = 0; j < 4; ++j) {
        const uint at = 16 * image + j;
        m[j] = vec4(view_to_world[at], view_to_world[at + 4], view_to_world[at + 8], view_to_world[at + 12]);
    }
    return m;
}

vec3 pixel_ray(uint image, uint pixel) {
    vec3 ray = vec3(rays[pixel], rays[params.pixels + pixel], rays[2 * params.pixels + pixel]);
    if (params.focals != 0) ray.xy /= vec2(focal[2 * image], focal[2 * image + 1]);
    return ray;
}

// V^T M3 V for the coefficients of degree 1, whose axes are (-y, z, -x): rotated = coefficients * T.
mat3 sh_rotation(mat4 m) {
    return mat3(m[1][1], -m[1][2], m[1][0], -m[2][1], m[2][2], -m[2][0], m[0][1], -m[0][2], m[0][0]);
}

// Hamilton product, (w, x, y, z).
vec4 quaternion_product(vec4 a, vec4 b) {
    return vec4(a.x * b.x - dot(a.yzw, b.yzw), a.x * b.yzw + b.x * a.yzw + cross(a.yzw, b.yzw));
}

#endif
