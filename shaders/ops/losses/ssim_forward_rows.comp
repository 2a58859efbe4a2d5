#version 460
// The window along rows over p, p^2, q and q^2 (similarity.glsl). One invocation computes one quad of each.
// Bindings: a, b (quads), rows: four planes of quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "losses/ssim.glsl"
#include "store.glsl"
QUADS(0, a);
QUADS(1, b);
QUADS_OUT(2, rows);

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.quads) return;
    const int x = column_of(i);
    vec4 sums[4];
    [[unroll]] for (int k = 0; k < 4; ++k) sums[k] = vec4(0);
    [[unroll]] for (int tap = 0; tap < kTaps; ++tap) {
        const uint at = tap_quad(i, tap, x, dims.width, 1);
        const bool inside = tap_inside(tap, x, dims.width);
        const vec4 from_a = LD4(a, at), from_b = LD4(b, at);
        const vec4 p = inside ? from_a + from_b - kPivot : vec4(-kPivot);
        const vec4 q = inside ? from_a - from_b : vec4(0);
        const vec4 wp = kWindow[tap] * p, wq = kWindow[tap] * q;
        sums[0] += wp;
        sums[1] += wp * p;
        sums[2] += wq;
        sums[3] += wq * q;
    }
    [[unroll]] for (uint k = 0; k < 4; ++k) ST4(rows, k * dims.quads + i, sums[k]);
}
