#version 460
// y = scale * (a + b). One invocation computes one quad. Bindings: a, b, y, all quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/add_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, a);
QUADS(1, b);
QUADS_OUT(2, y);
layout(push_constant) uniform Push { AddParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i < params.quads) ST4(y, i, params.scale * (LD4(a, i) + LD4(b, i)));
}
