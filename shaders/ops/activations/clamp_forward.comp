#version 460
// y = min(max(x, least), most), NaN of NaN. One invocation computes one quad. Bindings: x, y, both quads.
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
#include "keep_nan.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    vec4 t = LD4(x, i);  // drivers may turn NaN into a bound of clamp()
    t = mix(t, vec4(params.least), lessThan(t, vec4(params.least)));
    t = mix(t, vec4(params.most), greaterThan(t, vec4(params.most)));
    ST4(y, i, channels_below(t, i / params.pixels * 4, params.channels));
}
