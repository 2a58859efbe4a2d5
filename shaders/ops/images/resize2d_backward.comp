#version 460
// One axis of the gradient: grad_x[outer, i, inner] = sum over the pixels of y that pixel i of x reaches of its weight
// there and grad_y; resize2d.glsl has the weights. One invocation computes one quad of grad_x.
// Bindings: grad_y, grad_x, both quads. Specialisation: kCubic, kAntialias.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
QUADS_OUT(1, grad_x);
layout(push_constant) uniform Push { Resize2dParams params; };

#include "launch.glsl"
#include "images/resize2d.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint line = i / params.inner;
    const uint outer = line / params.from;
    if (outer >= params.outer) return;
    const int pixel = int(line - outer * params.from);
    const float middle = float(pixel) + 0.5;
    const float reach = float(kReach) * params.stretch;
    // Pixels of y that may hold it; pixels at the edges also stand for what lies outside.
    const int last = int(params.to) - 1;
    int low = max(int(floor((middle - reach) * params.rate - 0.5)), 0);
    int high = min(int(ceil((middle + reach) * params.rate - 0.5)), last);
    if (pixel == 0) low = 0;
    if (pixel == int(params.from) - 1) high = last;
    const uint start = outer * params.to * params.inner + (i - line * params.inner);
    vec4 sum = vec4(0);
    for (int at = low; at <= high; ++at)
        sum += weight_of(uint(at), pixel) * LD4(grad_y, start + uint(at) * params.inner);
    ST4(grad_x, i, sum);
}
