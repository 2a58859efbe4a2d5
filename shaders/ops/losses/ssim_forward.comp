#version 460
// The window along columns completes the moments m of a, b, a^2, b^2 and a b; from them the similarity
//   S = A1 A2 / (B1 B2),  A1 = 2 ma mb + C1, A2 = 2 (mab - ma mb) + C2, B1 = ma^2 + mb^2 + C1,
//   B2 = (maa - ma^2) + (mbb - mb^2) + C2
// and its slopes with respect to ma, maa and mab. One workgroup sums one chunk of S.
// Bindings: rows (five planes of quads), slopes (three planes of quads), partial [chunks].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "ssim.glsl"
#include "store.glsl"
QUADS(0, rows);
QUADS_OUT(1, slopes);
layout(set = 0, binding = 2, std430) writeonly buffer Partial { float partial[]; };

#include "channels.glsl"
#include "reduce.glsl"

const float kC1 = 1e-4;
const float kC2 = 9e-4;

vec4 similarity(uint i) {
    const int y = row_of(i);
    vec4 m[5];
    [[unroll]] for (int k = 0; k < 5; ++k) m[k] = vec4(0);
    [[unroll]] for (int tap = 0; tap < kTaps; ++tap) {
        const uint at = tap_quad(i, tap, y, dims.height, dims.width);
        const float weight = tap_weight(tap, y, dims.height);
        [[unroll]] for (uint k = 0; k < 5; ++k) m[k] += weight * LD4(rows, k * dims.quads + at);
    }
    const vec4 a1 = 2 * m[0] * m[1] + kC1;
    const vec4 a2 = 2 * (m[4] - m[0] * m[1]) + kC2;
    const vec4 b1 = m[0] * m[0] + m[1] * m[1] + kC1;
    const vec4 b2 = (m[2] - m[0] * m[0]) + (m[3] - m[1] * m[1]) + kC2;
    const vec4 s = a1 * a2 / (b1 * b2);
    ST4(slopes, i, 2 * (m[1] * (a2 - a1) / (b1 * b2) + m[0] * s * (1 / b2 - 1 / b1)));
    ST4(slopes, dims.quads + i, -s / b2);
    ST4(slopes, 2 * dims.quads + i, 2 * a1 / (b1 * b2));
    const uint first = 4 * (i / (dims.n * dims.height * dims.width));
    return channels_below(s, first, dims.c);
}

void main() {
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, dims.quads);
    vec4 sum = vec4(0);
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        sum += similarity(i);
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group * dims.chunk < dims.quads)
        partial[group] = sum.x + sum.y + sum.z + sum.w;
}
