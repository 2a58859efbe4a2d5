#version 460
// Like radix_sort_spine.comp, for devices whose shaders run on a CPU. It also writes places [lanes][bins]: where
// a lane's first entry of each digit goes. One workgroup of 8 lanes, which must be one subgroup; each lane
// takes four bins at a time.
// Bindings: table [lanes][bins], input_count, range; places, kept. Specialisation: kBits: most bits of a digit,
// kRanged: digits by the range of the keys.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/radix_sort_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kRadixSortBitsId) const uint kBits = 8;
layout(constant_id = kRadixSortRangedId) const bool kRanged = false;
UINT_QUADS(0, table);
UINTS(1, input_count);
UINTS(2, range);
UINT_QUADS_OUT(3, places);
layout(set = 0, binding = 4, std430) buffer Kept { uint kept[]; };  // accumulates
layout(push_constant) uniform Push { RadixSortParams params; };

#include "radix_digit.glsl"

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const Digit digit =
        kRanged ? ranged_digit(LD1(range, 0), LD1(range, 1), kBits) : fixed_digit(kBits);
    if (digit.bits == 0) return;
    const uint bins = 1u << digit.bits;
    const uint lanes = lanes_for(digit.first ? min(LD1(input_count, 0), params.capacity) : kept[0]);
    const uint quads = bins / 4;  // quads of a lane's row
    uint before = 0;              // entries of smaller digits
    uint first = 0;
    do {
        const bool inside = first + lane < quads;
        uvec4 totals = uvec4(0);
        uint l = 0;
        do {  // 8 per turn: lavapipe limits turns (src/vk/launch.h)
            [[unroll]] for (uint j = 0; j < 8; ++j)
                totals += l + j < lanes ? LDU4(table, (l + j) * quads + first + lane) : uvec4(0);
            l += 8;
        } while (l < lanes);
        const uvec3 within = uvec3(totals.x, totals.x + totals.y, totals.x + totals.y + totals.z);
        const uint total = inside ? within.z + totals.w : 0;
        uint sum = total;
        [[unroll]] for (uint s = 0; s < 3; ++s) {
            const uint step = 1u << s;
            const uint other = subgroupShuffle(sum, (lane - step) & 7u);
            sum += lane >= step ? other : 0;
        }
        uvec4 place = before + sum - total + uvec4(0, within);
        l = 0;
        do {
            [[unroll]] for (uint j = 0; j < 8; ++j) {
                const uint at = (l + j) * quads + first + lane;
                if (inside && l + j < lanes) STU4(places, at, place);
                place += LDU4(table, at);
            }
            l += 8;
        } while (l < lanes);
        before += subgroupShuffle(sum, 7u);
        first += 8;
    } while (first < quads);
    if (digit.first && lane == 0) kept[0] = before;
}
