// The two passes of a mean of TERM(a - b); the kernel defines TERM or SLOPE, its derivative.

#ifndef SPLAT_PIXEL_LOSS_GLSL
#define SPLAT_PIXEL_LOSS_GLSL

#include "load.glsl"
#include "store.glsl"
#include "params/loss_params.h"

QUADS(0, a);
QUADS(1, b);
layout(push_constant) uniform Push { LossParams params; };

#ifdef TERM
layout(set = 0, binding = 2, std430) writeonly buffer Partial { float partial[]; };
#include "reduce.glsl"

// One workgroup sums one chunk. Channels that pad a quad are equal, so their terms are zero.
void sum_chunk() {
    const uint group = gl_WorkGroupID.y * params.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * params.chunk, params.quads);
    vec4 sum = vec4(0);
    for (uint i = group * params.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x) {
        const vec4 difference = LD4(a, i) - LD4(b, i);
        sum += TERM(difference);
    }
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group < params.sums) partial[group] = sum.x + sum.y + sum.z + sum.w;
}
#else
QUADS(2, grad_loss);
QUADS_OUT(3, grad_a);
#include "launch.glsl"

// One invocation computes one quad.
void slope_of_quad() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const vec4 difference = LD4(a, i) - LD4(b, i);
    ST4(grad_a, i, (LD4(grad_loss, 0).x * params.scale) * SLOPE(difference));
}
#endif

#endif
