#version 460
// Turn the network's output into one 3D Gaussian per pixel: channels depth, [offset 3,] opacity, scale 3, rotation 4,
// dc 3, [rest 9].
//   p = ray * (sigmoid(depth) * (zfar - znear) + znear + origin) + offset
//   means = r.xyz / (r.w + 1e-10), r = [p, 1] view_to_world      opacities = sigmoid, scales = exp
//   rotations = quaternion * q / max(|q|, 1e-12)   sh = dc, then the rest turned with the camera
// One invocation computes one Gaussian.
// Bindings: net_out, rays, view_to_world, quaternion, focal, origin, means, opacities, scales,
// rotations, sh. Specialisation: kOffset, kDegree.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/gaussian_head_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "gaussian_head.glsl"
#include "store.glsl"
layout(set = 0, binding = 6, std430) writeonly buffer Means { float means[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Opacities { float opacities[]; };
layout(set = 0, binding = 8, std430) writeonly buffer Scales { float scales[]; };
QUADS_OUT(9, rotations);
layout(set = 0, binding = 10, std430) writeonly buffer Sh { float sh[]; };

void main() {
    const uint g = invocation_index(dims.groups_x);
    const uint count = dims.images * dims.pixels;
    if (g >= count) return;
    const uint image = g / dims.pixels;
    float raw[4 * kMostQuads];
    [[unroll]] for (uint q = 0; q < kMostQuads; ++q)
        if (q < kQuads) {
            const vec4 value = LD4(net_out, q * count + g);
            [[unroll]] for (uint k = 0; k < 4; ++k) raw[4 * q + k] = value[k];
        }
    const Camera camera = camera_of(image);

    vec3 point = ray_of(image, g - image * dims.pixels) * depth_of(image, sigmoid(raw[0]));
    if (kOffset != 0) point += vec3(raw[1], raw[2], raw[3]);
    const vec4 world = to_world(camera, point);
    const vec3 mean = world.xyz / (world.w + kDivisorGuard);
    vec3 scale = vec3(raw[kScale], raw[kScale + 1], raw[kScale + 2]);
    if (dims.isotropic != 0) scale = scale.xxx;
    if (dims.activate != 0) scale = exp(scale);
    const vec4 q = vec4(raw[kRotation], raw[kRotation + 1], raw[kRotation + 2], raw[kRotation + 3]);

    opacities[g] = dims.activate != 0 ? sigmoid(raw[kOpacity]) : raw[kOpacity];
    ST4(rotations, g, hamilton(camera.rotation, q / max(norm_of(q), kLeastNorm)));
    float turn[3][3];
    sh_turn(camera, turn);
    const uint first = 3 * g * (1 + 3 * kDegree);
    [[unroll]] for (uint i = 0; i < 3; ++i) {
        means[3 * g + i] = mean[i];
        scales[3 * g + i] = scale[i];
        sh[first + i] = raw[kDc + i];
        if (kDegree > 0) {
            [[unroll]] for (uint t = 0; t < 3; ++t)
                sh[first + 3 + 3 * t + i] = raw[kRest + i] * turn[0][t] + raw[kRest + 3 + i] * turn[1][t] +
                                            raw[kRest + 6 + i] * turn[2][t];
        }
    }
}
