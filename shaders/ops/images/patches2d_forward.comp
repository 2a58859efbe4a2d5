#version 460
// Pixels of patches become channels: y[(c * size + r) * size + s, i, j] = x[c, i * size + r, j * size + s]. It is the
// backward pass of the inverse operator, too. One invocation computes one quad of y. Bindings: x, y, both quads.
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { Patches2dParams params; };

#include "launch.glsl"
#include "channels.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint pixels = params.rows * params.columns;
    const uint quad = i / (params.n * pixels);
    const uint each = params.size * params.size;
    const uint channels = params.c * each;
    if (4 * quad >= channels) return;
    const uint image = i / pixels % params.n;
    const uint top = i % pixels / params.columns * params.size;
    const uint left = i % params.columns * params.size;
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint channel = 4 * quad + k;
        if (channel >= channels) continue;
        const uint c = channel / each;
        const uint row = (c / 4 * params.n + image) * params.rows * params.size + top + channel % each / params.size;
        const uint column = left + channel % params.size;
        value[k] = component(LD4(x, row * params.columns * params.size + column), c % 4);
    }
    ST4(y, i, value);
}
