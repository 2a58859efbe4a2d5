#version 460
// y = max(x, 0). One invocation computes one quad. Bindings: x, y, both quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/activation_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { ActivationParams params; };

#include "keep_nan.glsl"
#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const vec4 t = LD4(x, i);
    ST4(y, i, mix(t, vec4(0), lessThan(t, vec4(0))));  // drivers may turn NaN into a bound of max()
}
