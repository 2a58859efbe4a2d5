#version 460
// grad_x = grad_y * sigmoid(x). One invocation computes one quad.
// Bindings: x, grad_y, grad_x, all quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/activation_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, grad_y);
QUADS_OUT(2, grad_x);
layout(push_constant) uniform Push { ActivationParams params; };

#include "launch.glsl"
#include "activations/sigmoid.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i < params.quads) ST4(grad_x, i, LD4(grad_y, i) * sigmoid(LD4(x, i)));
}
