#version 460
// Like tile_bin_reduce.comp, for GPUs: a workgroup, not a lane, sums a chunk of 16 entries an invocation.
// Bindings and specialisation as there; sums [workgroups].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/tile_bin_params.h"
#include "raster/scan.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
layout(set = 0, binding = 0, std430) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, std430) readonly buffer Order { uvec2 order[]; };
layout(set = 0, binding = 2, std430) readonly buffer Sorted { uint sorted[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Sums { uint sums[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Ordered { uint ordered[]; };
layout(push_constant) uniform Push { TileBinParams params; };

void main() {
    const uint count = kByIndex ? params.items : sorted[0];
    const uint first = gl_WorkGroupID.x * 16 * kWorkgroupSize + gl_LocalInvocationID.x;
    uvec4 quads[4];
    [[unroll]] for (uint k = 0; k < 16; ++k) {
        const uint i = first + k * kWorkgroupSize;
        const uint tiles = i < count ? counts[kByIndex ? i : order[i].y] : 0;
        if (!kByIndex && i < count) ordered[i] = tiles;
        quads[k / 4][k % 4] = tiles;
    }
    uint sum = 0;
    scan_quads(quads, sum);
    if (gl_LocalInvocationID.x == 0) sums[gl_WorkGroupID.x] = sum;
}
