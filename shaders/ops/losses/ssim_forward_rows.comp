#version 460
// The window along rows over a, b, a^2, b^2 and a b. One invocation computes one quad of each.
// Bindings: a, b (quads), rows: five planes of quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "ssim.glsl"
#include "store.glsl"
QUADS(0, a);
QUADS(1, b);
QUADS_OUT(2, rows);

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.quads) return;
    const int x = column_of(i);
    vec4 sums[5];
    [[unroll]] for (int k = 0; k < 5; ++k) sums[k] = vec4(0);
    [[unroll]] for (int tap = 0; tap < kTaps; ++tap) {
        const uint at = tap_quad(i, tap, x, dims.width, 1);
        const float weight = tap_weight(tap, x, dims.width);
        const vec4 p = LD4(a, at), q = LD4(b, at);
        const vec4 wp = weight * p, wq = weight * q;
        sums[0] += wp;
        sums[1] += wq;
        sums[2] += wp * p;
        sums[3] += wq * q;
        sums[4] += wp * q;
    }
    [[unroll]] for (uint k = 0; k < 5; ++k) ST4(rows, k * dims.quads + i, sums[k]);
}
