#version 460
// The window along columns completes the moments of p, p^2, q and q^2; from them the similarity S and its slopes with
// respect to the means, E[p^2] and E[q^2] (similarity.glsl). One workgroup sums one chunk of S.
// Bindings: rows (four planes of quads), slopes (three planes of quads), partial [chunks].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "losses/ssim.glsl"
#include "store.glsl"
QUADS(0, rows);
QUADS_OUT(1, slopes);
layout(set = 0, binding = 2, std430) writeonly buffer Partial { float partial[]; };

#include "channels.glsl"
#include "reduce.glsl"

vec4 similarity_at(uint i) {
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
    const Similarity found = similarity(m);
    [[unroll]] for (uint k = 0; k < 3; ++k) ST4(slopes, k * dims.quads + i, found.slopes[k]);
    const uint first = 4 * (i / (dims.n * dims.height * dims.width));
    return channels_below(found.luminance * found.structure, first, dims.c);
}

void main() {
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, dims.quads);
    vec4 sum = vec4(0);
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        sum += similarity_at(i);
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group * dims.chunk < dims.quads)
        partial[group] = sum.x + sum.y + sum.z + sum.w;
}
