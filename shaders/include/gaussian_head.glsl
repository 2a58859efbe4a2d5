// Shared by both passes of gaussian_head: the first six bindings, the order of channels, a pixel's values
// and its point in the world.

#ifndef SPLAT_GAUSSIAN_HEAD_GLSL
#define SPLAT_GAUSSIAN_HEAD_GLSL

#include "load.glsl"
#include "params/gaussian_head_params.h"
#include "raster_constants.h"
#include "table.glsl"

layout(constant_id = kGaussianHeadPositionsId) const uint kPositions = kHeadRayDepth;
layout(constant_id = kGaussianHeadOffsetId) const uint kOffset = 1;  // 1: three channels move the point off its ray
layout(constant_id = kGaussianHeadDegreeId) const uint kDegree = 1;  // degree of the spherical harmonics, 0 or 1
layout(constant_id = kGaussianHeadDirectId) const uint kDirect = 0;  // 1: colours are red, green and blue
layout(constant_id = kGaussianHeadPerPixelId) const uint kPerPixel = 1;
layout(constant_id = kGaussianHeadChannelsId) const uint kChannels = 24;  // a Gaussian has so many
layout(constant_id = kGaussianHeadOpacityActivationId) const uint kOpacityActivation = kHeadSigmoid;
layout(constant_id = kGaussianHeadScaleActivationId) const uint kScaleActivation = kHeadExp;
layout(constant_id = kGaussianHeadColourActivationId) const uint kColourActivation = kHeadIdentity;
// A Gaussian's channels before each block.
layout(constant_id = kGaussianHeadDepthAtId) const uint kDepthAt = 0;
layout(constant_id = kGaussianHeadPointAtId) const uint kPointAt = 1;
layout(constant_id = kGaussianHeadOpacityAtId) const uint kOpacityAt = 4;
layout(constant_id = kGaussianHeadScaleAtId) const uint kScaleAt = 5;
layout(constant_id = kGaussianHeadRotationAtId) const uint kRotationAt = 8;
layout(constant_id = kGaussianHeadColourAtId) const uint kColourAt = 12;
layout(constant_id = kGaussianHeadRestAtId) const uint kRestAt = 15;

QUADS(0, net_out);        // [channels/4][images * pixels]
QUADS(1, rays);           // [3,pixels]
QUADS(2, view_to_world);  // [images,4,4]: a row per quad
TABLE(3, quaternion);     // [images,4]
QUADS(4, focal);          // [images,2]
QUADS(5, origin);         // [images], or with kHeadInputDepth [images,pixels]
layout(push_constant) uniform Push { GaussianHeadParams dims; };

#include "launch.glsl"
#include "finite.glsl"
#include "activations/sigmoid.glsl"
#include "activations/softplus.glsl"
#include "norms/quaternion.glsl"

const uint kQuads = (kPerPixel * kChannels + 3) / 4;  // a pixel has so many
const uint kColorQuads = 1 + 2 * kDegree;  // quads of a Gaussian in a set
const float kLeastNorm = 1e-12;   // least length of a rotation
const float kDivisorGuard = 1e-10;  // added to the homogeneous coordinate

// Element i of an array of quads.
#define AT(name, i) LD4(name, (i) / 4)[(i) % 4]
// Three channels.
#define RAW3(i) vec3(raw[i], raw[(i) + 1], raw[(i) + 2])

float activated(uint activation, float t) {
    if (activation == kHeadSigmoid) return sigmoid(t);
    if (activation == kHeadExp) return exp(t);
    if (activation == kHeadSoftplus) return softplus(vec4(t)).x / 10;
    if (activation == kHeadTanh) return sigmoid(2 * t);
    return t;
}

// The derivative of activated().
float slope(uint activation, float t) {
    if (activation == kHeadTanh) return 2 * sigmoid_derivative(vec4(2 * t)).x;
    const float s = sigmoid(t);
    if (activation == kHeadSigmoid) return s * (1 - s);
    if (activation == kHeadExp) return exp(t);
    if (activation == kHeadSoftplus) return s / 10;
    return 1;
}

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
    if (kPositions == kHeadBox) {  // the world has its own
        for (uint i = 0; i < 4; ++i) camera.row[i] = vec4(i == 0, i == 1, i == 2, i == 3);
        camera.rotation = vec4(1, 0, 0, 0);
        return camera;
    }
    for (uint i = 0; i < 4; ++i) camera.row[i] = LD4(view_to_world, 4 * image + i);
    camera.rotation = TABLE4(quaternion, image);
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

float depth_of(uint image, uint pixel, float s) {
    if (kPositions == kHeadInputDepth) return AT(origin, image * dims.pixels + pixel);
    float depth = s * (dims.most - dims.least) + dims.least;
    if (dims.has_origin != 0) depth += AT(origin, image);
    return depth;
}

bvec3 is_inside(vec3 point) {
    return bvec3(uvec3(greaterThanEqual(point, vec3(dims.least))) & uvec3(lessThanEqual(point, vec3(dims.most))));
}

// Compares, as clamp() may make a bound of NaN.
float clamped(float x) {
    if (!finite(x)) return x;
    return clamp(x, dims.least, dims.most);
}

// A pixel's point in its camera's frame; `s` is the sigmoid of the depth's channel, `given` the point's.
vec3 point_of(uint image, uint pixel, vec3 ray, float s, vec3 given) {
    if (kPositions == kHeadBox) return vec3(clamped(given.x), clamped(given.y), clamped(given.z));
    const vec3 point = ray * depth_of(image, pixel, s);
    return kOffset != 0 ? point + given : point;
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

// What the Gaussians of pixel `p`, counted over all images, share.
struct Pixel {
    uint p, image, pixel;
    vec3 ray;
    Camera camera;
    float turn[3][3];
};

Pixel pixel_of(uint p) {
    Pixel at;
    at.p = p;
    at.image = p / dims.pixels;
    at.pixel = p - at.image * dims.pixels;
    at.ray = ray_of(at.image, at.pixel);
    at.camera = camera_of(at.image);
    sh_turn(at.camera, at.turn);
    return at;
}

#endif
