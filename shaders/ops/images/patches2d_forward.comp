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
    const uint plane = i / pixels;
    const uint quad = plane / params.n;
    const uint each = params.size * params.size;
    const uint channels = params.c * each;
    if (4 * quad >= channels) return;
    const uint image = plane - quad * params.n;
    const uint top = (i - plane * pixels) / params.columns;
    const uint left = i - plane * pixels - top * params.columns;
    uint c = 4 * quad / each;
    uint r = (4 * quad - c * each) / params.size;
    uint s = 4 * quad - c * each - r * params.size;
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint row = ((c / 4 * params.n + image) * params.rows + top) * params.size + r;
        const uint at = (row * params.columns + left) * params.size + s;
        value[k] = c < params.c ? component(LD4(x, c < params.c ? at : 0), c % 4) : 0.0;
        ++s;
        if (s == params.size) ++r, s = 0;
        if (r == params.size) ++c, r = 0;
    }
    ST4(y, i, value);
}
