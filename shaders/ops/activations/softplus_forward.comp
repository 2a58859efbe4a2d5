#version 460
// y = log(1 + exp(x)). One invocation computes one quad. Bindings: x, y, both quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/activation_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { ActivationParams params; };

#include "launch.glsl"
#include "channels.glsl"
#include "activations/softplus.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    ST4(y, i, channels_below(softplus(LD4(x, i)), i / params.pixels * 4, params.channels));
}
