#version 460
// grad_beta = sum of grad_y over all pixels, grad_gamma = sum of grad_y * (x - mean) * rstd; both add to the existing
// values when accumulate is set. One workgroup computes a quad of channels, its lanes run along the pixels.
// Bindings: x, mean [2,N*P], rstd [N*P], grad_y, grad_gamma [C], grad_beta [C].
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/layer_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
layout(set = 0, binding = 1, std430) readonly buffer Mean { float mean_in[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rstd { float rstd_in[]; };
QUADS(3, grad_y);
layout(set = 0, binding = 4, std430) buffer GradGamma { float grad_gamma[]; };  // accumulates
layout(set = 0, binding = 5, std430) buffer GradBeta { float grad_beta[]; };    // accumulates
layout(push_constant) uniform Push { LayerNormParams dims; };

#include "reduce.glsl"

void main() {
    const uint quad = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = (dims.channels + 3) / 4 - 1;
    const uint lane = gl_LocalInvocationID.x;
    const uint start = min(quad, last) * dims.columns;
    vec4 first = vec4(0);
    vec4 second = vec4(0);
    for (uint p = lane; p < dims.columns; p += gl_WorkGroupSize.x) {
        const float rstd = rstd_in[p];
        const vec4 xhat = (LD4(x, start + p) - mean_in[p]) * rstd - mean_in[dims.columns + p] * rstd;
        const vec4 grad = LD4(grad_y, start + p);
        first += grad;
        second += grad * xhat;
    }
    first = workgroup_sum(first);
    second = workgroup_sum(second);
    const uint c = 4 * quad + lane;
    if (lane >= 4 || c >= dims.channels) return;
    grad_beta[c] = dims.accumulate != 0 ? grad_beta[c] + first[lane] : first[lane];
    grad_gamma[c] = dims.accumulate != 0 ? grad_gamma[c] + second[lane] : second[lane];
}
