#version 460
// y[i,j] = the maximum of x[2i..2i+1, 2j..2j+1]; a last odd row or column is ignored.
// One invocation computes one quad of y. Bindings: x, y, both quads.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { MaxPool2dParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint width = params.width / 2;
    const uint pixels = params.height / 2 * width;
    if (i >= params.planes * pixels) return;
    const uint plane = i / pixels;
    const uint row = i % pixels / width;
    const uint at = (plane * params.height + 2 * row) * params.width + 2 * (i % width);
    const vec4 upper = max(LD4(x, at), LD4(x, at + 1));
    const uint below = at + params.width;
    ST4(y, i, max(upper, max(LD4(x, below), LD4(x, below + 1))));
}
