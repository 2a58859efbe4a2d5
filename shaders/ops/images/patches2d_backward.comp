#version 460
// Channels become pixels of patches: y[c, i * size + r, j * size + s] = x[(c * size + r) * size + s, i, j], for x the
// gradient of patches2d's y; it is the forward pass of the inverse operator, too.
// One invocation computes one quad of y. Bindings: x, y, both quads.
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
    const uint size = params.size;
    const uint width = params.columns * size;
    const uint pixels = params.rows * size * width;
    const uint quad = i / (params.n * pixels);
    if (4 * quad >= params.c) return;
    const uint image = i / pixels % params.n;
    const uint row = i % pixels / width;
    const uint column = i % width;
    const uint patch_at = row / size * params.columns + column / size;
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        if (4 * quad + k >= params.c) continue;
        const uint channel = ((4 * quad + k) * size + row % size) * size + column % size;
        const uint at = (channel / 4 * params.n + image) * params.rows * params.columns + patch_at;
        value[k] = component(LD4(x, at), channel % 4);
    }
    ST4(y, i, value);
}
