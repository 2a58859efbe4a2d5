#version 460
// Exclusive sum of the lanes' sums, and with it the number of pairs. It decides here, on the device,
// whether the pass draws (on CPU devices tile_bin_emit_cpu.comp does). If more pairs are needed than fit,
// none is made, and the host reads their number. One workgroup of one invocation.
// Bindings: sums [lanes] in place, sorted (entries of the depth order), stats
// (include/params/tile_bin_params.h), pairs (their number, for the sort).
// Specialisation: kByIndex: only the sums.
#extension GL_GOOGLE_include_directive : require
#include "params/tile_bin_params.h"
#include "saturating.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
layout(set = 0, binding = 0, std430) buffer Sums { uint sums[]; };  // accumulates
layout(set = 0, binding = 1, std430) readonly buffer Sorted { uint sorted[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Stats { uint stats[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Pairs { uint pairs[]; };
layout(push_constant) uniform Push { TileBinParams params; };

void main() {
    if (gl_GlobalInvocationID.x != 0) return;
    uint total = 0;
    for (uint lane = 0; lane < params.lanes; ++lane) {
        const uint sum = sums[lane];
        sums[lane] = total;
        total = saturating_add(total, sum);
    }
    if (kByIndex) return;
    const bool fits = total <= params.capacity;
    stats[kStatVisible] = sorted[0];
    stats[kStatNeeded] = total;
    stats[kStatPairs] = fits ? total : 0;
    pairs[0] = fits ? total : 0;
}
