#version 460
// grad_beta[c] = sum_n sums[n,c].x, grad_gamma[c] = sum_n sums[n,c].y; both add to the existing
// values when accumulate is set.
// One invocation computes one channel. Bindings: sums [N,C] vec2, grad_gamma [C], grad_beta [C].
#extension GL_GOOGLE_include_directive : require
#include "params/group_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Sums { vec2 sums[]; };
layout(set = 0, binding = 1, std430) buffer GradGamma { float grad_gamma[]; };  // accumulates
layout(set = 0, binding = 2, std430) buffer GradBeta { float grad_beta[]; };    // accumulates
layout(push_constant) uniform Push { GroupNormParams dims; };

void main() {
    const uint c = gl_GlobalInvocationID.x;
    if (c >= dims.c) return;
    vec2 sum = vec2(0);
    for (uint n = 0; n < dims.n; ++n) sum += sums[n * dims.c + c];
    grad_beta[c] = dims.accumulate != 0 ? grad_beta[c] + sum.x : sum.x;
    grad_gamma[c] = dims.accumulate != 0 ? grad_gamma[c] + sum.y : sum.y;
}
