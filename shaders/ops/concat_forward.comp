#version 460
// y[n] = (a[n], b[n]) along the channels, for a of any number of channels.
// One invocation computes one quad of y. Bindings: a, b, y, all quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/concat_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, a);
QUADS(1, b);
QUADS_OUT(2, y);
layout(push_constant) uniform Push { ConcatParams params; };

#include "channels.glsl"
#include "launch.glsl"

// Quad `quad` of b; zero beyond its last.
vec4 quad_of_b(int quad, uint column) {
    const int last = int(params.b - 1) / 4;
    const vec4 value = LD4(b, uint(clamp(quad, 0, last)) * params.columns + column);
    return quad >= 0 && quad <= last ? value : vec4(0);
}

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint channels = params.a + params.b;
    if (i >= (channels + 3) / 4 * params.columns) return;
    const uint first = 4 * (i / params.columns);
    const uint column = i % params.columns;
    const vec4 of_a = LD4(a, min(first, params.a - 1) / 4 * params.columns + column);
    if (first + 4 <= params.a) {
        ST4(y, i, of_a);
        return;
    }
    const uint ahead = first + 4 - params.a;  // channels of b up to the end of this quad
    const vec4 of_b = shifted(quad_of_b(int(ahead / 4) - 1, column), quad_of_b(int(ahead / 4), column), ahead % 4);
    const vec4 value = mix(of_b, of_a, lessThan(first + uvec4(0, 1, 2, 3), uvec4(params.a)));
    ST4(y, i, channels_below(value, first, channels));
}
