#version 460
// Noise on means (Kheradmand et al. 2024, "3D Gaussian Splatting as Markov Chain Monte Carlo", eq. 8):
//   mean += scale gate(opacity) Sigma eta, gate(o) = 1 / (1 + exp(100 (o - 0.005)))
// with the covariance Sigma and three normal numbers eta, of the Gaussian's row, the step and the seed (Philox, Box and
// Muller). A mean that would not be finite stays.
// One invocation moves one Gaussian. Bindings: set (activated), raw [N,3] quads; raw and set to write.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "finite.glsl"
#include "philox.glsl"
#include "fit/rotate.glsl"
#include "sincos.glsl"
#include "params/fit_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, set);
QUADS(1, raw);
QUADS_OUT(2, raw_out);
QUADS_OUT(3, set_out);
layout(push_constant) uniform Push { FitNoiseParams params; };

#include "launch.glsl"

const uint kNoise = 2;  // the last word of the counter tells uses of the seed apart

vec3 normal_numbers(uint i) {
    const uvec4 words = philox(uvec4(i, params.step_low, params.step_high, kNoise),
                               uvec2(params.seed_low, params.seed_high));
    const vec4 u = (vec4(words >> 9u) + 0.5) * exp2(-23);
    const vec2 length = sqrt(-2 * log(u.xy));
    return vec3(length.x * sincos(6.28318531 * u.z).yx, length.y * sincos(6.28318531 * u.w).y);
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.gaussians) return;
    const vec4 mean = LD4(set, 3 * i), q = LD4(set, 3 * i + 2);
    const vec3 scale = LD4(set, 3 * i + 1).xyz;
    const vec4 turn = q / length(q);
    const float gate = 1 / (1 + exp(100 * (mean.w - 0.005)));
    const vec3 along = scale * scale * rotate(vec4(turn.x, -turn.yzw), normal_numbers(i));
    const vec3 moved = mean.xyz + params.scale * gate * rotate(turn, along);
    if (!finite(moved)) return;
    ST4(raw_out, 3 * i, vec4(moved, LD4(raw, 3 * i).w));
    ST4(set_out, 3 * i, vec4(moved, mean.w));
}
