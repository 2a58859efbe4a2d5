#version 460
// Sums the tile counts over contiguous chunks of the depth order, one lane each. Sums saturate at
// 2^32 - 1. The counts by depth are kept for tile_bin_offsets.comp, as they are scattered in memory.
// Bindings: counts [V*N], order uvec2 (depth, item), sorted (its length); sums [lanes], ordered [V*N].
// Specialisation: kByIndex: by index instead of depth; nothing is kept.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/tile_bin_params.h"
#include "saturating.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
UINTS(0, counts);
UINTS(1, order);
UINTS(2, sorted);
layout(set = 0, binding = 3, std430) writeonly buffer Sums { uint sums[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Ordered { uint ordered[]; };
layout(push_constant) uniform Push { TileBinParams params; };

#include "raster/tile_bin.glsl"

void main() {
    const uint lane = gl_GlobalInvocationID.x;
    if (lane >= params.lanes) return;
    const uvec2 chunk = tile_chunk(lane, kByIndex ? params.items : LD1(sorted, 0));
    uint sum = 0;
    for (uint i = chunk.x; i < chunk.y; ++i) {
        const uint count = LD1(counts, kByIndex ? i : LD1(order, 2 * i + 1));
        if (!kByIndex) ordered[i] = count;
        sum = saturating_add(sum, count);
    }
    sums[lane] = sum;
}
