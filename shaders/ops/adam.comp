#version 460
// One step of Adam on a quad of parameters, in place:
//   m = beta1 m + (1 - beta1) g     v = beta2 v + (1 - beta2) g^2
//   value -= step_size m / (root_scale sqrt(v) + eps)
// One invocation updates one quad, unless the last of the scalars is not 0: the step is skipped.
// Bindings: value, grad, m, v, again value, m, v to write, and the scalars; all quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/optimiser_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, value);
QUADS(1, grad);
QUADS(2, m);
QUADS(3, v);
QUADS_OUT(4, value_out);
QUADS_OUT(5, m_out);
QUADS_OUT(6, v_out);
QUADS(7, scalars);
layout(push_constant) uniform Push { AdamParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const vec4 betas = LD4(scalars, 2 * params.rule);
    const vec4 rate = LD4(scalars, 2 * params.rule + 1);
    if (rate.w != 0) return;
    const vec4 g = LD4(grad, i);
    const vec4 first = betas.x * LD4(m, i) + betas.y * g;
    const vec4 second = betas.z * LD4(v, i) + betas.w * g * g;
    const vec4 divisor = rate.y * sqrt(second) + rate.z;
    ST4(value_out, i, LD4(value, i) - rate.x * (first / divisor));
    ST4(m_out, i, first);
    ST4(v_out, i, second);
}
