#version 460
// One axis of y = x resized: y[outer, i, inner] = sum over the pixels of x near the middle of pixel i of their weight
// and x; resize2d.glsl has the weights. One invocation computes one quad of y. Bindings: x, y, both quads.
// Specialisation: kCubic, kAntialias.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { Resize2dParams params; };

#include "launch.glsl"
#include "images/resize2d.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint line = i / params.inner;
    const uint outer = line / params.to;
    if (outer >= params.outer) return;
    const Taps taps = taps_of(line - outer * params.to);
    const uint start = outer * params.from * params.inner + (i - line * params.inner);
    vec4 sum = vec4(0);
    if (kAntialias) {
        float total = 0;
        for (int at = taps.first; at <= taps.last; ++at) {
            const float weight = weight_at(taps, at);
            sum += weight * LD4(x, start + uint(at) * params.inner);
            total += weight;
        }
        sum /= total;
    } else {
        for (uint k = 0; k < kFixedTaps; ++k) {
            const int at = taps.first + int(k);
            sum += weight_at(taps, at) * LD4(x, start + uint(inside(at)) * params.inner);
        }
    }
    ST4(y, i, sum);
}
