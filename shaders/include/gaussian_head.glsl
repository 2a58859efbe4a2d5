// Shared by both passes of gaussian_head: the first six bindings, the order of channels, a pixel's values
// and its point in the world.

#ifndef SPLAT_GAUSSIAN_HEAD_GLSL
#define SPLAT_GAUSSIAN_HEAD_GLSL

#include "load.glsl"
#include "params/gaussian_head_params.h"

layout(constant_id = kGaussianHeadOffsetId) const uint kOffset = 1;  // 1: three channels offset the point from its ray
layout(constant_id = kGaussianHeadDegreeId) const uint kDegree = 1;  // degree of the spherical harmonics, 0 or 1

QUADS(0, net_out);        // [channels/4][images * pixels]
QUADS(1, rays);           // [3,pixels]
QUADS(2, view_to_world);  // [images,4,4]: a row per quad
QUADS(3, quaternion);     // [images,4]
QUADS(4, focal);          // [images,2]
QUADS(5, origin);         // [images]
layout(push_constant) uniform Push { GaussianHeadParams dims; };

#include "launch.glsl"
#include "activations/silu.glsl"
#include "norms/quaternion.glsl"

const uint kOpacity = 1 + 3 * kOffset;
const uint kScale = kOpacity + 1;
const uint kRotation = kScale + 3;
const uint kDc = kRotation + 4;
const uint kRest = kDc + 3;
const uint kQuads = (kRest + 9 * kDegree + 3) / 4;
const uint kMostQuads = 6;
const float kLeastNorm = 1e-12;   // least length of a rotation
const float kDivisorGuard = 1e-10;  // added to the homogeneous coordinate

// Element i of an array of quads.
#define AT(name, i) LD4(name, (i) / 4)[(i) % 4]

vec4 hamilton(vec4 a, vec4 b) {  // w first
    return vec4(a.x * b.x - dot(a.yzw, b.yzw), a.x * b.yzw + b.x * a.yzw + cross(a.yzw, b.yzw));
}

// Row-vector matrix of the camera, and its quaternion.
struct Camera {
    vec4 row[4];
    vec4 rotation;
};

Camera camera_of(uint image) {
    Camera camera;
    for (uint i = 0; i < 4; ++i) camera.row[i] = LD4(view_to_world, 4 * image + i);
    camera.rotation = LD4(quaternion, image);
    return camera;
}

vec3 ray_of(uint image, uint pixel) {
    vec3 ray = vec3(AT(rays, pixel), AT(rays, dims.pixels + pixel), AT(rays, 2 * dims.pixels + pixel));
    if (dims.has_focal != 0) {
        const vec4 pair = LD4(focal, image / 2);
        ray.xy /= image % 2 == 0 ? pair.xy : pair.zw;
    }
    return ray;
}

float depth_of(uint image, float s) {
    float depth = s * dims.depth_range + dims.znear;
    if (dims.has_origin != 0) depth += AT(origin, image);
    return depth;
}

// [point, 1] times the camera's matrix.
vec4 to_world(Camera camera, vec3 point) {
    return point.x * camera.row[0] + point.y * camera.row[1] + point.z * camera.row[2] + camera.row[3];
}

// The rotation of coefficients 1 to 3, which run along -y, z and -x: out_t = sum_s in_s turn[s][t].
void sh_turn(Camera camera, out float turn[3][3]) {
    const vec3 x = camera.row[0].xyz, y = camera.row[1].xyz, z = camera.row[2].xyz;
    turn[0] = float[3](y.y, -y.z, y.x);
    turn[1] = float[3](-z.y, z.z, -z.x);
    turn[2] = float[3](x.y, -x.z, x.x);
}

#endif
