#version 460
// Like tile_bin_reduce.comp, for devices whose shaders run on a CPU: a workgroup of 8 lanes sums one chunk. It
// keeps no counts and sums no chunks, as tile_bin_emit_cpu.comp does. Needs a workgroup of one subgroup.
// Bindings: counts, order, sorted; sums. Specialisation as there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "params/tile_bin_params.h"
#include "saturating.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTileBinByIndexId) const bool kByIndex = false;
UINTS(0, counts);
UINTS(1, order);
UINTS(2, sorted);
layout(set = 0, binding = 3, std430) writeonly buffer Sums { uint sums[]; };
layout(push_constant) uniform Push { TileBinParams params; };

#include "raster/tile_bin.glsl"

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uvec2 chunk = tile_chunk(gl_WorkGroupID.x, kByIndex ? params.items : LD1(sorted, 0));
    uint sum = 0;
    uint i = chunk.x;
    if (i < chunk.y) do {  // every lane takes the same number of turns
        const uint at = min(i + lane, chunk.y - 1);
        const uint count = LD1(counts, kByIndex ? at : LD1(order, 2 * at + 1));
        sum = saturating_add(sum, i + lane < chunk.y ? count : 0);
        i += 8;
    } while (i < chunk.y);
    [[unroll]] for (uint s = 0; s < 3; ++s) sum = saturating_add(sum, subgroupShuffleXor(sum, 1u << s));
    if (lane == 0) sums[gl_WorkGroupID.x] = sum;
}
