#version 460
// Each pixel's channels to one Gaussian in world space; equations in src/ops/gaussian_head.h.
// One invocation computes one pixel. Bindings: net_out quads (read by component), rays [3,P],
// view_to_world [B*V,4,4], quaternion [B*V,4], focal [B*V,2], distance [B*V,P], means [B*V*P,3],
// opacities, scales [.,3], rotations [.,4], sh [.,K,3].
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
layout(set = 0, binding = 5, std430) readonly buffer Distance { float distance_plane[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Means { float means[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Opacities { float opacities[]; };
layout(set = 0, binding = 8, std430) writeonly buffer Scales { float scales[]; };
layout(set = 0, binding = 9, std430) writeonly buffer Rotations { vec4 rotations[]; };
layout(set = 0, binding = 10, std430) writeonly buffer Sh { float sh[]; };
layout(push_constant) uniform Push { GaussianHeadParams params; };

#include "gaussian_head.glsl"
#include "launch.glsl"
#include "silu.glsl"

float net(uint c, uint i) { return uintBitsToFloat(LD1(net_out, place(c, i))); }

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.images * params.pixels) return;
    const uint image = i / params.pixels;
    const mat4 m = row_matrix(image);

    float depth = sigmoid(net(0, i)) * (params.zfar - params.znear) + params.znear;
    if (params.distances != 0) depth += distance_plane[i];
    vec3 p = pixel_ray(image, i % params.pixels) * depth;
    if (kOffset != 0) p += vec3(net(1, i), net(2, i), net(3, i));
    const vec4 world = vec4(p, 1) * m;
    const vec3 mean = world.xyz / (world.w + kMinW);
    [[unroll]] for (uint k = 0; k < 3; ++k) means[3 * i + k] = mean[k];

    const float logit = net(kOpacityAt, i);
    opacities[i] = params.activate != 0 ? sigmoid(logit) : logit;

    vec3 scale = vec3(net(kScalesAt, i), net(kScalesAt + 1, i), net(kScalesAt + 2, i));
    if (params.isotropic != 0) scale = scale.xxx;
    if (params.activate != 0) scale = exp(scale);
    [[unroll]] for (uint k = 0; k < 3; ++k) scales[3 * i + k] = scale[k];

    const vec4 q =
        vec4(net(kRotationAt, i), net(kRotationAt + 1, i), net(kRotationAt + 2, i), net(kRotationAt + 3, i));
    rotations[i] = quaternion_product(quaternion[image], q / max(length(q), kMinNorm));

    const uint to = 3 * kShCoefficients * i;
    const mat3 turn = params.sh_transform != 0 ? sh_rotation(m) : mat3(1);
    [[unroll]] for (uint rgb = 0; rgb < 3; ++rgb) {
        sh[to + rgb] = net(kShAt + rgb, i);
        if (kDegree == 0) continue;
        const vec3 rest = vec3(net(kShAt + 3 + rgb, i), net(kShAt + 6 + rgb, i), net(kShAt + 9 + rgb, i)) * turn;
        [[unroll]] for (uint k = 0; k < 3; ++k) sh[to + 3 * (k + 1) + rgb] = rest[k];
    }
}
