#version 460
// Like tile_bin_scan.comp, for GPUs: one workgroup sums in parallel.
// Bindings and specialisation as there; sums in quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/tile_bin_params.h"
#include "raster/scan.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
layout(set = 0, binding = 0, std430) buffer Sums { uvec4 sums[]; };  // accumulates
layout(set = 0, binding = 1, std430) readonly buffer Sorted { uint sorted[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Stats { uint stats[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Pairs { uint pairs[]; };
layout(push_constant) uniform Push { TileBinParams params; };

void main() {
    const uint l = gl_LocalInvocationID.x;
    uint total = 0;
    for (uint first = l; first - l < params.lanes / 4; first += 4 * kWorkgroupSize) {
        uvec4 quads[4];
        [[unroll]] for (uint k = 0; k < 4; ++k) {
            const uint at = first + k * kWorkgroupSize;
            quads[k] = at < params.lanes / 4 ? sums[at] : uvec4(0);
        }
        scan_quads(quads, total);
        [[unroll]] for (uint k = 0; k < 4; ++k) {
            const uint at = first + k * kWorkgroupSize;
            if (at < params.lanes / 4) sums[at] = quads[k];
        }
    }
    if (kByIndex || l > 0) return;
    const uint made = total <= params.capacity ? total : 0;
    stats[kStatVisible] = sorted[0];
    stats[kStatNeeded] = total;
    stats[kStatPairs] = made;
    pairs[0] = made;
}
