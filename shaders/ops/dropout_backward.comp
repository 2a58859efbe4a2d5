#version 460
// grad_x = grad_y / (1 - p) where kept, else 0; the mask depends only on the counter and the element's position,
// so that both passes have the same. One invocation computes one quad.
// Bindings: grad_y quads, counter (seed low, seed high, step, stream offset), grad_x quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/dropout_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
layout(set = 0, binding = 1, std430) readonly buffer Counter { uint counter[]; };
QUADS_OUT(2, grad_x);
layout(push_constant) uniform Push { DropoutParams params; };

#include "launch.glsl"
#include "philox.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.quads) return;
    const uvec4 random =
        philox(uvec4(i, counter[2], params.stream + counter[3], 0), uvec2(counter[0], counter[1]));
    const bvec4 keep = greaterThanEqual(random, uvec4(params.threshold));
    ST4(grad_x, i, mix(vec4(0), params.scale * LD4(grad_y, i), keep));
}
