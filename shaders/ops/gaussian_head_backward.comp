#version 460
// Gradient of gaussian_head with respect to the network's output; derived in tests/ref/gaussian_head_ref.h.
// One invocation computes all channels of one pixel; those that pad the last quad become zero.
// Bindings: net_out, rays, view_to_world, quaternion, focal, origin, grad_gaussians, grad_colors,
// grad_net_out. Specialisation: as gaussian_head_forward.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/gaussian_head_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "gaussian_head.glsl"
#include "store.glsl"
QUADS(6, grad_gaussians);
QUADS(7, grad_colors);
QUADS_OUT(8, grad_net_out);

// Gradient with respect to the rotation's four channels q.
vec4 rotation_gradient(vec4 camera, vec4 q, vec4 grad) {
    const vec4 by_unit = hamilton(vec4(camera.x, -camera.yzw), grad);
    const float norm = norm_of(q);
    if (norm <= kLeastNorm) return by_unit / kLeastNorm;
    const vec4 unit = q / norm;
    return (by_unit - unit * dot(unit, by_unit)) / norm;
}

float raw[4 * kQuads], grad[4 * kQuads];

// The gradients of Gaussian `each` of a pixel.
void backward(Pixel at, uint each) {
    const uint c = each * kChannels, g = at.p * kPerPixel + each;
    const float s = sigmoid(raw[c + kDepthAt]);
    const vec3 given = RAW3(c + kPointAt);
    const vec4 world = to_world(at.camera, point_of(at.image, at.pixel, at.ray, s, given));
    const float divisor = world.w + kDivisorGuard;
    const vec4 by_first = LD4(grad_gaussians, 3 * g);
    const vec3 by_mean = by_first.xyz;
    const vec4 by_world = vec4(by_mean, -dot(by_mean, world.xyz / divisor)) / divisor;
    vec3 by_point;
    for (uint i = 0; i < 3; ++i) by_point[i] = dot(at.camera.row[i], by_world);
    if (kPositions == kHeadRayDepth)
        grad[c + kDepthAt] = dot(at.ray, by_point) * (dims.most - dims.least) * s * (1 - s);
    if (kPositions == kHeadBox) by_point = mix(vec3(0), by_point, is_inside(given));
    if (kOffset != 0 || kPositions == kHeadBox) {
        [[unroll]] for (uint i = 0; i < 3; ++i) grad[c + kPointAt + i] = by_point[i];
    }

    grad[c + kOpacityAt] = by_first.w * slope(kOpacityActivation, raw[c + kOpacityAt]);
    const vec3 scale = RAW3(c + kScaleAt);
    vec3 by_scale = LD4(grad_gaussians, 3 * g + 1).xyz;
    if (dims.isotropic != 0) by_scale = vec3(by_scale.x + by_scale.y + by_scale.z, 0, 0);
    const uint r = c + kRotationAt;
    const vec4 q = vec4(raw[r], raw[r + 1], raw[r + 2], raw[r + 3]);
    const vec4 by_rotation = rotation_gradient(at.camera.rotation, q, LD4(grad_gaussians, 3 * g + 2));
    [[unroll]] for (uint i = 0; i < 3; ++i)
        grad[c + kScaleAt + i] =
            by_scale[i] * slope(kScaleActivation, dims.isotropic != 0 ? scale.x : scale[i]);
    [[unroll]] for (uint i = 0; i < 4; ++i) grad[r + i] = by_rotation[i];

    const uint first = 4 * kColorQuads * g;
    [[unroll]] for (uint i = 0; i < 3; ++i) {
        float by_colour = AT(grad_colors, first + i);
        if (kDirect != 0) by_colour *= slope(kColourActivation, raw[c + kColourAt + i]) / kSh0;
        grad[c + kColourAt + i] = by_colour;
        if (kDegree > 0) {
            const float x = AT(grad_colors, first + 3 + i), y = AT(grad_colors, first + 6 + i),
                        z = AT(grad_colors, first + 9 + i);
            [[unroll]] for (uint t = 0; t < 3; ++t)
                grad[c + kRestAt + 3 * t + i] = at.turn[t][0] * x + at.turn[t][1] * y + at.turn[t][2] * z;
        }
    }
}

void main() {
    const uint p = invocation_index(dims.groups_x);
    const uint count = dims.images * dims.pixels;
    if (p >= count) return;
    [[unroll]] for (uint q = 0; q < kQuads; ++q) {
        const vec4 value = LD4(net_out, q * count + p);
        [[unroll]] for (uint k = 0; k < 4; ++k) {
            raw[4 * q + k] = value[k];
            grad[4 * q + k] = 0;
        }
    }
    const Pixel at = pixel_of(p);
    if (kPerPixel == 1) {  // at constant places; of several the unrolled code would take long to compile
        backward(at, 0);
    } else {
        for (uint each = 0; each < kPerPixel; ++each) backward(at, each);
    }
    [[unroll]] for (uint q = 0; q < kQuads; ++q)
        ST4(grad_net_out, q * count + p, vec4(grad[4 * q], grad[4 * q + 1], grad[4 * q + 2], grad[4 * q + 3]));
}
