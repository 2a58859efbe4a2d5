#version 460
// shadow -= (shadow - value) (1 - decay), in place; with decay 0 an exact copy. One invocation updates
// one quad.
// Bindings: value, shadow, and shadow again to write; all quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/optimiser_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, value);
QUADS(1, shadow);
QUADS_OUT(2, shadow_out);
layout(push_constant) uniform Push { EmaParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const vec4 online = LD4(value, i);
    const vec4 before = LD4(shadow, i);
    ST4(shadow_out, i, params.rest == 1 ? online : before - (before - online) * params.rest);
}
