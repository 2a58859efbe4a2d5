#version 460
// y = x * Phi(x), or its form by tanh (form 1). One invocation computes one quad. Bindings: x, y, both quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/activation_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { ActivationParams params; };

#include "launch.glsl"
#include "activations/gelu.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i < params.quads) ST4(y, i, gelu(LD4(x, i), params.form == 1));
}
