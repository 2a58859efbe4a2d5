#version 460
// grad_x = scale * grad_y for either summand. One invocation computes one quad. Bindings: grad_y,
// grad_x, both quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/add_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
QUADS_OUT(1, grad_x);
layout(push_constant) uniform Push { AddParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i < params.quads) ST4(grad_x, i, params.scale * LD4(grad_y, i));
}
