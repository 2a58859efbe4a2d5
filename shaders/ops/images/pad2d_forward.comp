#version 460
// y[i, j] = x[i - top, j - left]; outside of x the nearest pixel if kReplicate, else 0.
// One invocation computes one quad of y. Bindings: x, y, both quads. Specialisation: kReplicate.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kPad2dReplicateId) const bool kReplicate = false;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { Pad2dParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint line = i / params.new_width;
    const uint plane = line / params.new_height;
    if (plane >= params.planes) return;
    const ivec2 at = ivec2(i % params.new_width, line % params.new_height) - ivec2(params.left, params.top);
    const ivec2 nearest = clamp(at, ivec2(0), ivec2(params.width, params.height) - 1);
    const vec4 value = LD4(x, (plane * params.height + uint(nearest.y)) * params.width + uint(nearest.x));
    ST4(y, i, kReplicate || at == nearest ? value : vec4(0));
}
