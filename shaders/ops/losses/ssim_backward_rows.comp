#version 460
// The window along rows over the three slopes. One invocation computes one quad of each.
// Bindings: slopes, rows: three planes of quads each.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "losses/ssim.glsl"
#include "store.glsl"
QUADS(0, slopes);
QUADS_OUT(1, rows);

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.quads) return;
    const int x = column_of(i);
    vec4 sums[3];
    [[unroll]] for (int k = 0; k < 3; ++k) sums[k] = vec4(0);
    [[unroll]] for (int tap = 0; tap < kTaps; ++tap) {
        const uint at = tap_quad(i, tap, x, dims.width, 1);
        const float weight = tap_weight(tap, x, dims.width);
        [[unroll]] for (uint k = 0; k < 3; ++k) sums[k] += weight * LD4(slopes, k * dims.quads + at);
    }
    [[unroll]] for (uint k = 0; k < 3; ++k) ST4(rows, k * dims.quads + i, sums[k]);
}
