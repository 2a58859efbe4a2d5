#version 460
// The window along columns completes the moments m of p, p^2, q and q^2 (ssim.glsl); from them the similarity
//   S = A1 A2 / (B1 B2),  A1 = 2 ma mb + C1, A2 = 2 cov + C2, B1 = ma^2 + mb^2 + C1, B2 = va + vb + C2
// and its slopes: with respect to the means, E[p^2] and E[q^2]. One workgroup sums one chunk of S.
// Bindings: rows (four planes of quads), slopes (three planes of quads), partial [chunks].
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
    const vec4 outside[4] = vec4[4](vec4(-kPivot), vec4(kPivot * kPivot), vec4(0), vec4(0));
    vec4 m[4];
    [[unroll]] for (int k = 0; k < 4; ++k) m[k] = vec4(0);
    [[unroll]] for (int tap = 0; tap < kTaps; ++tap) {
        const uint at = tap_quad(i, tap, y, dims.height, dims.width);
        const bool inside = tap_inside(tap, y, dims.height);
        [[unroll]] for (uint k = 0; k < 4; ++k)
            m[k] += kWindow[tap] * (inside ? LD4(rows, k * dims.quads + at) : outside[k]);
    }
    const vec4 mp = m[0] + kPivot, mq = m[2];
    const vec4 vp = max(m[1] - m[0] * m[0], vec4(0)), vq = max(m[3] - mq * mq, vec4(0));
    const vec4 a1 = 0.5 * (mp * mp - mq * mq) + kC1, b1 = 0.5 * (mp * mp + mq * mq) + kC1;
    const vec4 a2 = 0.5 * (vp - vq) + kC2, b2 = 0.5 * (vp + vq) + kC2;
    const vec4 luminance = a1 / b1, structure = a2 / b2;
    // b1 - a1 = mq^2 and b2 - a2 = vq
    const vec4 by_vp = 0.5 * luminance * vq / (b2 * b2), by_vq = -0.5 * luminance * (vp + 2 * kC2) / (b2 * b2);
    const vec4 by_means = structure * mq * (mp * mq - mp * mp - 2 * kC1) / (b1 * b1);
    ST4(slopes, i, by_means - 2 * (m[0] * by_vp + mq * by_vq));
    ST4(slopes, dims.quads + i, by_vp);
    ST4(slopes, 2 * dims.quads + i, by_vq);
    const uint first = 4 * (i / (dims.n * dims.height * dims.width));
    return channels_below(luminance * structure, first, dims.c);
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
