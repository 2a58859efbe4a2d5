#version 460
// The gradient of gaussian_head_forward.comp with respect to net_out; src/ops/gaussian_head.h.
// One invocation computes one pixel. Bindings: net_out quads (read by component), rays [3,P],
// view_to_world [B*V,4,4], quaternion [B*V,4], focal [B*V,2], grad_means, grad_opacities, grad_scales,
// grad_rotations, grad_sh as the outputs, grad_net_out quads.
// Specialisation: 10 kOffset (1: channels 1 to 3 are an offset), 11 kDegree of sh (0 or 1).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/gaussian_head_params.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kOffset = 1;
layout(constant_id = 11) const uint kDegree = 1;
UINTS(0, net_out);
layout(set = 0, binding = 1, std430) readonly buffer Rays { float rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer ViewToWorld { float view_to_world[]; };
layout(set = 0, binding = 3, std430) readonly buffer Quaternion { vec4 quaternion[]; };
layout(set = 0, binding = 4, std430) readonly buffer Focal { float focal[]; };
layout(set = 0, binding = 5, std430) readonly buffer GradMeans { float grad_means[]; };
layout(set = 0, binding = 6, std430) readonly buffer GradOpacities { float grad_opacities[]; };
layout(set = 0, binding = 7, std430) readonly buffer GradScales { float grad_scales[]; };
layout(set = 0, binding = 8, std430) readonly buffer GradRotations { vec4 grad_rotations[]; };
layout(set = 0, binding = 9, std430) readonly buffer GradSh { float grad_sh[]; };
layout(set = 0, binding = 10, std430) writeonly buffer GradNetOut { float grad_net_out[]; };
layout(set = 0, binding = 11, std430) readonly buffer Distance { float distance_plane[]; };
layout(push_constant) uniform Push { GaussianHeadParams params; };

#include "gaussian_head.glsl"
#include "launch.glsl"
#include "silu.glsl"

float net(uint c, uint i) { return uintBitsToFloat(LD1(net_out, place(c, i))); }
void put(uint c, uint i, float value) { grad_net_out[place(c, i)] = value; }

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.images * params.pixels) return;
    const uint image = i / params.pixels;
    const mat4 m = row_matrix(image);

    const float s = sigmoid(net(0, i));
    const float span = params.zfar - params.znear;
    const vec3 ray = pixel_ray(image, i % params.pixels);
    float depth = s * span + params.znear;
    if (params.distances != 0) depth += distance_plane[i];
    vec3 p = ray * depth;
    if (kOffset != 0) p += vec3(net(1, i), net(2, i), net(3, i));
    const vec4 world = vec4(p, 1) * m;
    const float w = world.w + kMinW;
    const vec3 grad_mean = vec3(grad_means[3 * i], grad_means[3 * i + 1], grad_means[3 * i + 2]);
    const vec4 grad_world = vec4(grad_mean / w, -dot(grad_mean, world.xyz) / (w * w));
    const vec3 grad_p = (m * grad_world).xyz;
    put(0, i, dot(grad_p, ray) * span * s * (1 - s));
    if (kOffset != 0) {
        [[unroll]] for (uint k = 0; k < 3; ++k) put(1 + k, i, grad_p[k]);
    }

    const float opacity = sigmoid(net(kOpacityAt, i));
    put(kOpacityAt, i, grad_opacities[i] * (params.activate != 0 ? opacity * (1 - opacity) : 1.0));

    vec3 grad_scale = vec3(grad_scales[3 * i], grad_scales[3 * i + 1], grad_scales[3 * i + 2]);
    vec3 scale = vec3(net(kScalesAt, i), net(kScalesAt + 1, i), net(kScalesAt + 2, i));
    if (params.isotropic != 0) grad_scale = vec3(grad_scale.x + grad_scale.y + grad_scale.z, 0, 0);
    if (params.activate != 0) grad_scale *= exp(scale);
    [[unroll]] for (uint k = 0; k < 3; ++k) put(kScalesAt + k, i, params.isotropic != 0 && k > 0 ? 0.0 : grad_scale[k]);

    const vec4 q =
        vec4(net(kRotationAt, i), net(kRotationAt + 1, i), net(kRotationAt + 2, i), net(kRotationAt + 3, i));
    const float norm = max(length(q), kMinNorm);
    const vec4 unit = q / norm;
    // Multiplying from the left by a quaternion has as adjoint multiplying by its conjugate.
    vec4 grad_q = quaternion_product(quaternion[image] * vec4(1, -1, -1, -1), grad_rotations[i]);
    if (norm > kMinNorm) grad_q -= unit * dot(unit, grad_q);
    [[unroll]] for (uint k = 0; k < 4; ++k) put(kRotationAt + k, i, grad_q[k] / norm);

    const uint from = 3 * kShCoefficients * i;
    const mat3 turn = params.sh_transform != 0 ? sh_rotation(m) : mat3(1);
    [[unroll]] for (uint rgb = 0; rgb < 3; ++rgb) {
        put(kShAt + rgb, i, grad_sh[from + rgb]);
        if (kDegree == 0) continue;
        const vec3 grad_rest =
            turn * vec3(grad_sh[from + 3 + rgb], grad_sh[from + 6 + rgb], grad_sh[from + 9 + rgb]);
        [[unroll]] for (uint k = 0; k < 3; ++k) put(kShAt + 3 * (k + 1) + rgb, i, grad_rest[k]);
    }
    // The last quad's missing channels are zero by convention.
    for (uint c = kShAt + 3 * kShCoefficients; c % 4 != 0; ++c) put(c, i, 0);
}
