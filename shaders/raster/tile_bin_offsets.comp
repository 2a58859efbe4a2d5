#version 460
// First pair of every entry of the depth order, or first record of every item: chunks as in
// tile_bin_reduce.comp.
// Bindings: counts [V*N] in that order, sorted (entries of the depth order), sums [lanes]; begins.
// Specialisation: kByIndex.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/tile_bin_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
UINTS(0, counts);
UINTS(1, sorted);
UINTS(2, sums);
layout(set = 0, binding = 3, std430) writeonly buffer Begins { uint begins[]; };
layout(push_constant) uniform Push { TileBinParams params; };

#include "raster/tile_bin.glsl"

void main() {
    const uint lane = gl_GlobalInvocationID.x;
    if (lane >= params.lanes) return;
    const uvec2 chunk = tile_chunk(lane, kByIndex ? params.items : LD1(sorted, 0));
    uint sum = LD1(sums, lane);
    for (uint i = chunk.x; i < chunk.y; ++i) {
        begins[i] = sum;
        sum += LD1(counts, i);
    }
}
