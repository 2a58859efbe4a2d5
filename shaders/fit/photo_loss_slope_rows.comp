#version 460
// The window along rows over the three slopes. One invocation computes one pixel.
// Bindings: slopes, rows: three planes of quads each.
#extension GL_GOOGLE_include_directive : require
#include "losses/photo_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Slopes { vec4 slopes[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Rows { vec4 rows[]; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    const uint pixels = dims.width * dims.height;
    if (i >= pixels) return;
    const int x = int(i % dims.width);
    vec4 sums[3] = vec4[3](vec4(0), vec4(0), vec4(0));
    for (int tap = 0; tap < kTaps; ++tap) {
        const int to = x + tap - kTaps / 2;
        if (to < 0 || to >= int(dims.width)) continue;
        for (uint k = 0; k < 3; ++k) sums[k] += kWindow[tap] * slopes[k * pixels + uint(int(i) + to - x)];
    }
    for (uint k = 0; k < 3; ++k) rows[k * pixels + i] = sums[k];
}
