#version 460
// grad_a = grad_loss / elements * (the transposed derivatives of the slopes). One invocation computes one quad, from
// those of its neighbours whose derivatives read it, at the pixel itself or at its reflections.
// Bindings: slopes (two planes of quads), grad_loss [1], grad_a (quads).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/image_loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "edge_loss.glsl"
#include "store.glsl"
QUADS(0, slopes);
QUADS(1, grad_loss);
QUADS_OUT(2, grad_a);

#include "launch.glsl"

// What the filters (difference, smoothing) at `from` read of the pixel `to` of a line.
vec2 taps(int from, int to, uint size) {
    vec2 sum = vec2(0);
    [[unroll]] for (int tap = -1; tap <= 1; ++tap)
        if (reflected(from + tap, size) == to) sum += vec2(float(tap), smoothing(tap));
    return from >= 0 && from < int(size) ? sum : vec2(0);
}

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.quads) return;
    const int x = column_of(i);
    const int y = row_of(i);
    vec4 sum = vec4(0);
    [[unroll]] for (int v = -1; v <= 1; ++v) {
        const vec2 along_y = taps(y + v, y, dims.height);
        const int row = clamp(y + v, 0, int(dims.height) - 1) - y;
        [[unroll]] for (int u = -1; u <= 1; ++u) {
            const vec2 along_x = taps(x + u, x, dims.width);
            const int column = clamp(x + u, 0, int(dims.width) - 1) - x;
            const uint at = uint(int(i) + row * int(dims.width) + column);
            sum += along_x.x * along_y.y * LD4(slopes, at);
            sum += along_x.y * along_y.x * LD4(slopes, dims.quads + at);
        }
    }
    ST4(grad_a, i, (LD4(grad_loss, 0).x * dims.scale) * sum);
}
