#version 460
// shadow -= (shadow - value) (1 - decay), in place; with decay 0 an exact copy. One invocation updates
// one quad.
// Bindings: value, shadow, shadow again to write, and a quad whose first number is 1 - decay; if its last is not 0,
// nothing is written; all quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/optimiser_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, value);
QUADS(1, shadow);
QUADS_OUT(2, shadow_out);
QUADS(3, scalars);
layout(push_constant) uniform Push { EmaParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const vec4 numbers = LD4(scalars, 0);
    if (numbers.w != 0) return;
    const float rest = numbers.x;
    const vec4 online = LD4(value, i);
    const vec4 before = LD4(shadow, i);
    ST4(shadow_out, i, rest == 1 ? online : before - (before - online) * rest);
}
