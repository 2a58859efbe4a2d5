#version 460
// Colour of every Gaussian that reaches a tile: max(0, 0.5 + sum_k sh[k] Y_k(d)) of the direction d
// from the camera to its mean, or the colour given. One invocation computes one entry of the sorted
// order. A Gaussian whose colour is not finite loses its opacity, so that it counts as absent.
// Bindings: gaussians [count][3], colors [count][sh_quads] vec4 (coefficients [K,3] flattened),
// cameras, order, sorted (their number); splats, radii, one slice of Gaussians per dispatch.
// Specialisation: 10 = degree.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "finite.glsl"
#include "load.glsl"
#include "params/project_params.h"
#include "sh.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const uint kDegree = 0;
QUADS(0, gaussians);
QUADS(1, colors);
QUADS(2, cameras);
UINTS(3, order);
UINTS(4, sorted);
layout(set = 0, binding = 5, std430) buffer Splats { vec4 splats[]; };    // accumulates
layout(set = 0, binding = 6, std430) buffer Radii { vec2 radii[]; };      // accumulates
layout(push_constant) uniform Push { ProjectParams params; };

#include "launch.glsl"

const uint kCameraQuads = 6;

void main() {
    const uint at = invocation_index(params.groups_x);
    if (at >= LD1(sorted, 0)) return;
    const uint item = LD1(order, at);
    const uint view = item / params.gaussians;
    const uint index = item - view * params.gaussians - params.first;
    if (index >= params.count) return;  // of another slice
    vec3 color;
    if ((params.flags & kFlagDirectColors) != 0) {
        color = LD4(colors, index).xyz;
    } else {
        const vec3 position = LD4(cameras, view * kCameraQuads + 5).xyz;
        const vec3 d = LD4(gaussians, index * 3).xyz - position;
        const float d2 = dot(d, d);
        float basis[16];
        sh_basis(kDegree, d2 > 0.0 ? d * inversesqrt(d2) : vec3(0), basis);
        const uint terms = (kDegree + 1) * (kDegree + 1);
        float f[48];
        [[unroll]] for (uint i = 0; i < (3 * terms + 3) / 4; ++i) {
            const vec4 v = LD4(colors, index * params.sh_quads + i);
            [[unroll]] for (uint c = 0; c < 4; ++c) f[4 * i + c] = v[c];
        }
        color = vec3(0);
        [[unroll]] for (uint k = 0; k < terms; ++k)
            color += basis[k] * vec3(f[3 * k], f[3 * k + 1], f[3 * k + 2]);
        const bool known = finite(color);
        color = known ? max(color + kShOffset, vec3(0)) : color;
    }
    if (finite(color)) {
        splats[item * 3 + 2] = vec4(color, 0);
    } else {
        splats[item * 3].z = 0;
        radii[item] = vec2(0);
    }
}
