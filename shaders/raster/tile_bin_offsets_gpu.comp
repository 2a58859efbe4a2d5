#version 460
// Like tile_bin_offsets.comp, for GPUs: chunks as in tile_bin_reduce_gpu.comp.
// Bindings and specialisation as there; counts and begins in quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/tile_bin_params.h"
#include "raster/scan.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
layout(set = 0, binding = 0, std430) readonly buffer Counts { uvec4 counts[]; };
layout(set = 0, binding = 1, std430) readonly buffer Sorted { uint sorted[]; };
layout(set = 0, binding = 2, std430) readonly buffer Sums { uint sums[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Begins { uvec4 begins[]; };
layout(push_constant) uniform Push { TileBinParams params; };

void main() {
    const uint count = kByIndex ? params.items : sorted[0];
    const uint first = gl_WorkGroupID.x * 4 * kWorkgroupSize + gl_LocalInvocationID.x;
    uvec4 quads[4];
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint at = first + k * kWorkgroupSize;
        quads[k] = 4 * at < count ? kept_items(counts[at], at, count) : uvec4(0);
    }
    uint before = sums[gl_WorkGroupID.x];
    scan_quads(quads, before);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint at = first + k * kWorkgroupSize;
        if (4 * at < count) begins[at] = quads[k];
    }
}
