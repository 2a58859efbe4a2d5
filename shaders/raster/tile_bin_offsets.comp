#version 460
// First pair of every Gaussian, in depth order: chunks as in tile_bin_reduce.comp.
// Bindings: counts [V*N], order, sorted, sums [lanes]; begins [V*N].
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/tile_bin_params.h"

layout(local_size_x_id = 0) in;
UINTS(0, counts);
UINTS(1, order);
UINTS(2, sorted);
UINTS(3, sums);
layout(set = 0, binding = 4, std430) writeonly buffer Begins { uint begins[]; };
layout(push_constant) uniform Push { TileBinParams params; };

void main() {
    const uint lane = gl_GlobalInvocationID.x;
    if (lane >= params.lanes) return;
    const uint length = LD1(sorted, 0);
    const uint chunk = (length + params.lanes - 1) / params.lanes;
    const uint begin = min(lane * chunk, length), end = min(begin + chunk, length);
    uint sum = LD1(sums, lane);
    for (uint i = begin; i < end; ++i) {
        const uint item = LD1(order, i);
        begins[item] = sum;
        sum += LD1(counts, item);
    }
}
