#version 460
// grad_x = gamma * grad_y, or grad_x = grad_y for a shift alone. One invocation computes one quad.
// Bindings: modulation quads, grad_y quads, grad_x quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/film_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, modulation);
QUADS(1, grad_y);
QUADS_OUT(2, grad_x);
layout(push_constant) uniform Push { FilmParams params; };

#include "film.glsl"
#include "launch.glsl"

void main() {
    const uint columns = params.n * params.p;
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.c + 3) / 4 * columns) return;
    const uint first = 4 * (i / columns);
    const vec4 gamma = params.shift != 0 ? vec4(1) : modulation_quad(first, i % columns / params.p);
    ST4(grad_x, i, channels_below(gamma * LD4(grad_y, i), first, params.c));
}
