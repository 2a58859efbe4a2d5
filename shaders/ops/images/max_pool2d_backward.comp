#version 460
// grad_x = grad_y of the window if x is its first maximum, row by row; else 0.
// One invocation computes one quad of grad_x. Bindings: x, grad_y, grad_x, all quads.
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, grad_y);
QUADS_OUT(2, grad_x);
layout(push_constant) uniform Push { MaxPool2dParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint pixels = params.height * params.width;
    if (i >= params.planes * pixels) return;
    const uint plane = i / pixels;
    const uint row = i % pixels / params.width;
    const uint column = i % params.width;
    const uint rows = params.height / 2;
    const uint columns = params.width / 2;
    const bool inside = row / 2 < rows && column / 2 < columns;
    // Outside all windows the first one is read but not used.
    const uint at = inside ? (plane * params.height + row / 2 * 2) * params.width + column / 2 * 2 : 0;
    const uint step = inside ? params.width : 0;
    const uint next = inside ? 1 : 0;
    const vec4 window[4] = vec4[4](LD4(x, at), LD4(x, at + next), LD4(x, at + step), LD4(x, at + step + next));
    vec4 greatest = window[0];
    uvec4 first = uvec4(0);
    [[unroll]] for (uint k = 1; k < 4; ++k) {
        first = mix(first, uvec4(k), greaterThan(window[k], greatest));
        greatest = max(greatest, window[k]);
    }
    const vec4 grad = LD4(grad_y, inside ? (plane * rows + row / 2) * columns + column / 2 : 0);
    const uvec4 own = uvec4(row % 2 * 2 + column % 2);
    ST4(grad_x, i, inside ? mix(vec4(0), grad, equal(first, own)) : vec4(0));
}
