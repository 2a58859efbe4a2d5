#version 460
// One step of Adam on a quad of parameters, in place:
//   m = beta1 m + (1 - beta1) g     v = beta2 v + (1 - beta2) g^2
//   value -= step_size m / (root_scale sqrt(v) + eps)
// One invocation updates one quad.
// Bindings: value, grad, m, v, and again value, m, v to write; all quads.
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
layout(push_constant) uniform Push { AdamParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const vec4 g = LD4(grad, i);
    const vec4 first = params.beta1 * LD4(m, i) + params.rest1 * g;
    const vec4 second = params.beta2 * LD4(v, i) + params.rest2 * g * g;
    const vec4 divisor = params.root_scale * sqrt(second) + params.eps;
    ST4(value_out, i, LD4(value, i) - params.step_size * (first / divisor));
    ST4(m_out, i, first);
    ST4(v_out, i, second);
}
