#version 460
// y = gamma * x + beta per image and channel; modulation [n, 2c] is gamma, then beta; [n, c] is a
// shift alone: y = x + beta. One invocation computes one quad.
// Bindings: x quads, modulation quads, y quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/film_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, modulation);
QUADS_OUT(2, y);
layout(push_constant) uniform Push { FilmParams params; };

#include "film.glsl"
#include "launch.glsl"

void main() {
    const uint columns = params.n * params.p;
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.c + 3) / 4 * columns) return;
    const uint n = i % columns / params.p;
    const uint first = 4 * (i / columns);
    vec4 value = LD4(x, i);
    if (params.shift != 0)
        value += modulation_quad(first, n);
    else
        value = modulation_quad(first, n) * value + modulation_quad(params.c + first, n);
    ST4(y, i, channels_below(value, first, params.c));
}
