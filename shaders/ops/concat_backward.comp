#version 460
// The gradient of one part: grad_x[n][c] = grad_y[n][offset + c] for c < count.
// One invocation computes one quad of grad_x. Bindings: grad_y, grad_x, both quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/concat_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
QUADS_OUT(1, grad_x);
layout(push_constant) uniform Push { ConcatParams params; };

#include "channels.glsl"
#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.count + 3) / 4 * params.columns) return;
    const uint first = 4 * (i / params.columns);
    const uint column = i % params.columns;
    const uint from = params.offset + first;
    const uint last = (params.a + params.b - 1) / 4;
    const vec4 low = LD4(grad_y, min(from / 4, last) * params.columns + column);
    const vec4 high = LD4(grad_y, min(from / 4 + 1, last) * params.columns + column);
    ST4(grad_x, i, channels_below(shifted(low, high, from % 4), first, params.count));
}
