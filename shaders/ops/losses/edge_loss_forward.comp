#version 460
// With Dx, Dy the derivatives of a - b: slopes = weight * sign(Dx), weight * sign(Dy), and partial = sum over a
// chunk of weight * (|Dx| + |Dy|); loss_sum averages them. One workgroup sums one chunk.
// Bindings: a, b (quads), weight (quads of one channel, or any if not weighted), slopes (two planes of quads),
// partial [chunks].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kImageLossWeightedId) const bool kWeighted = false;
#include "edge_loss.glsl"
#include "store.glsl"
QUADS(0, a);
QUADS(1, b);
QUADS(2, weight);
QUADS_OUT(3, slopes);
layout(set = 0, binding = 4, std430) writeonly buffer Partial { float partial[]; };

#include "reduce.glsl"

vec4 edges_of(uint i) {
    const int x = column_of(i);
    const int y = row_of(i);
    vec4 d[3][3];
    [[unroll]] for (int v = -1; v <= 1; ++v) {
        const int row = int(i) - x + (reflected(y + v, dims.height) - y) * int(dims.width);
        [[unroll]] for (int u = -1; u <= 1; ++u) {
            const uint at = uint(row + reflected(x + u, dims.width));
            d[v + 1][u + 1] = LD4(a, at) - LD4(b, at);
        }
    }
    // Differences first: at a border, where both taps are one pixel, they are 0 and have no sign.
    vec4 dx = vec4(0);
    vec4 dy = vec4(0);
    [[unroll]] for (int k = 0; k < 3; ++k) {
        dx += smoothing(k - 1) * (d[k][2] - d[k][0]);
        dy += smoothing(k - 1) * (d[2][k] - d[0][k]);
    }
    const uint pixel = i % (dims.n * dims.height * dims.width);
    const float by = kWeighted ? LD4(weight, pixel).x : 1.0;
    ST4(slopes, i, by * sign(dx));
    ST4(slopes, dims.quads + i, by * sign(dy));
    return by * (abs(dx) + abs(dy));
}

void main() {
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, dims.quads);
    vec4 sum = vec4(0);
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        sum += edges_of(i);
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group * dims.chunk < dims.quads)
        partial[group] = sum.x + sum.y + sum.z + sum.w;
}
