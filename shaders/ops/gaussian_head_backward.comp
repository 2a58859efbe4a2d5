#version 460
// Gradient of gaussian_head with respect to the network's output; derived in tests/ref/gaussian_head_ref.h.
// One invocation computes all channels of one pixel; those that pad the last quad become zero.
// Bindings: net_out, rays, view_to_world, quaternion, focal, origin, grad_means, grad_opacities,
// grad_scales, grad_rotations, grad_sh, grad_net_out. Specialisation: kOffset, kDegree.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/gaussian_head_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "gaussian_head.glsl"
#include "store.glsl"
QUADS(6, grad_means);
QUADS(7, grad_opacities);
QUADS(8, grad_scales);
QUADS(9, grad_rotations);
QUADS(10, grad_sh);
QUADS_OUT(11, grad_net_out);

// Gradient with respect to the rotation's four channels q.
vec4 rotation_gradient(vec4 camera, vec4 q, vec4 grad) {
    const vec4 by_unit = hamilton(vec4(camera.x, -camera.yzw), grad);
    const float norm = norm_of(q);
    if (norm <= kLeastNorm) return by_unit / kLeastNorm;
    const vec4 unit = q / norm;
    return (by_unit - unit * dot(unit, by_unit)) / norm;
}

void main() {
    const uint g = invocation_index(dims.groups_x);
    const uint count = dims.images * dims.pixels;
    if (g >= count) return;
    const uint image = g / dims.pixels;
    float raw[4 * kMostQuads], grad[4 * kMostQuads];
    [[unroll]] for (uint q = 0; q < kMostQuads; ++q) {
        const vec4 value = q < (kDc + 3) / 4 ? LD4(net_out, q * count + g) : vec4(0);
        [[unroll]] for (uint k = 0; k < 4; ++k) {
            raw[4 * q + k] = value[k];
            grad[4 * q + k] = 0;
        }
    }
    const Camera camera = camera_of(image);

    const vec3 ray = ray_of(image, g - image * dims.pixels);
    const float s = sigmoid(raw[0]);
    vec3 point = ray * depth_of(image, s);
    if (kOffset != 0) point += vec3(raw[1], raw[2], raw[3]);
    const vec4 world = to_world(camera, point);
    const float divisor = world.w + kDivisorGuard;
    const vec3 by_mean = vec3(AT(grad_means, 3 * g), AT(grad_means, 3 * g + 1), AT(grad_means, 3 * g + 2));
    const vec4 by_world = vec4(by_mean, -dot(by_mean, world.xyz / divisor)) / divisor;
    vec3 by_point;
    for (uint i = 0; i < 3; ++i) by_point[i] = dot(camera.row[i], by_world);
    grad[0] = dot(ray, by_point) * dims.depth_range * s * (1 - s);
    if (kOffset != 0) {
        [[unroll]] for (uint i = 0; i < 3; ++i) grad[1 + i] = by_point[i];
    }

    const float opacity = sigmoid(raw[kOpacity]);
    grad[kOpacity] = AT(grad_opacities, g) * (dims.activate != 0 ? opacity * (1 - opacity) : 1.0);
    const vec3 scale = vec3(raw[kScale], raw[kScale + 1], raw[kScale + 2]);
    vec3 by_scale = vec3(AT(grad_scales, 3 * g), AT(grad_scales, 3 * g + 1), AT(grad_scales, 3 * g + 2));
    if (dims.isotropic != 0) by_scale = vec3(by_scale.x + by_scale.y + by_scale.z, 0, 0);
    if (dims.activate != 0) by_scale *= exp(dims.isotropic != 0 ? scale.xxx : scale);
    const vec4 q = vec4(raw[kRotation], raw[kRotation + 1], raw[kRotation + 2], raw[kRotation + 3]);
    const vec4 by_rotation = rotation_gradient(camera.rotation, q, LD4(grad_rotations, g));
    [[unroll]] for (uint i = 0; i < 3; ++i) grad[kScale + i] = by_scale[i];
    [[unroll]] for (uint i = 0; i < 4; ++i) grad[kRotation + i] = by_rotation[i];

    float turn[3][3];
    sh_turn(camera, turn);
    const uint first = 3 * g * (1 + 3 * kDegree);
    [[unroll]] for (uint i = 0; i < 3; ++i) {
        grad[kDc + i] = AT(grad_sh, first + i);
        if (kDegree > 0) {
            const float x = AT(grad_sh, first + 3 + i), y = AT(grad_sh, first + 6 + i),
                        z = AT(grad_sh, first + 9 + i);
            [[unroll]] for (uint t = 0; t < 3; ++t)
                grad[kRest + 3 * t + i] = turn[t][0] * x + turn[t][1] * y + turn[t][2] * z;
        }
    }
    [[unroll]] for (uint q = 0; q < kMostQuads; ++q)
        if (q < kQuads)
            ST4(grad_net_out, q * count + g, vec4(grad[4 * q], grad[4 * q + 1], grad[4 * q + 2], grad[4 * q + 3]));
}
