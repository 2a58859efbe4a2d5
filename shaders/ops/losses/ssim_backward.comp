#version 460
// With D the slopes of S with respect to the moments, filtered by the window (which is its own transpose):
//   grad_a = grad_loss / elements * (D_means + 2 p D_pp + 2 q D_qq)
// One invocation computes one quad: the window along columns, and the sum.
// Bindings: a, b (quads), rows (three planes of quads), grad_loss [1], grad_a (quads).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "losses/ssim.glsl"
#include "store.glsl"
QUADS(0, a);
QUADS(1, b);
QUADS(2, rows);
QUADS(3, grad_loss);
QUADS_OUT(4, grad_a);

#include "channels.glsl"
#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.quads) return;
    const int y = row_of(i);
    vec4 d[3];
    [[unroll]] for (int k = 0; k < 3; ++k) d[k] = vec4(0);
    [[unroll]] for (int tap = 0; tap < kTaps; ++tap) {
        const uint at = tap_quad(i, tap, y, dims.height, dims.width);
        const float weight = tap_weight(tap, y, dims.height);
        [[unroll]] for (uint k = 0; k < 3; ++k) d[k] += weight * LD4(rows, k * dims.quads + at);
    }
    const vec4 of_a = LD4(a, i), of_b = LD4(b, i);
    const vec4 sum = d[0] + 2 * ((of_a + of_b - kPivot) * d[1] + (of_a - of_b) * d[2]);
    const uint first = 4 * (i / (dims.n * dims.height * dims.width));
    ST4(grad_a, i, channels_below((LD4(grad_loss, 0).x * dims.scale) * sum, first, dims.c));
}
