#version 460
// grad_x[i, j] = grad_y[i + top, j + left], 0 where y has no such pixel; on the border of x, if kReplicate, the sum
// over all pixels of y that are it. One invocation computes one quad of grad_x. Bindings: grad_y, grad_x, both quads.
// Specialisation: kReplicate.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kPad2dReplicateId) const bool kReplicate = false;
QUADS(0, grad_y);
QUADS_OUT(1, grad_x);
layout(push_constant) uniform Push { Pad2dParams params; };

#include "launch.glsl"

// First and last pixel of y along an axis that are pixel i of x, of `from` in x and `to` in y.
ivec2 copies(int i, int before, uint from, uint to) {
    ivec2 range = ivec2(i + before);
    if (kReplicate && i == 0) range.x = 0;
    if (kReplicate && i == int(from) - 1) range.y = int(to) - 1;
    return ivec2(max(range.x, 0), min(range.y, int(to) - 1));
}

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint line = i / params.width;
    const uint plane = line / params.height;
    if (plane >= params.planes) return;
    const ivec2 rows = copies(int(line % params.height), params.top, params.height, params.new_height);
    const ivec2 columns = copies(int(i % params.width), params.left, params.width, params.new_width);
    vec4 sum = vec4(0);
    for (int row = rows.x; row <= rows.y; ++row)
        for (int column = columns.x; column <= columns.y; ++column)
            sum += LD4(grad_y, (plane * params.new_height + uint(row)) * params.new_width + uint(column));
    ST4(grad_x, i, sum);
}
