#version 460
// Like blend_backward.comp, for GPUs. It stages the list in batches. Each subgroup takes a box of pixels, leaves out
// what the box cannot see and sums by transposition; after a batch the subgroups' sums are added in order. The walk
// begins at the last entry that any pixel blended.
// Work per workgroup and invocation, bindings and specialisation as there; kEarlyOut: skip entries that no pixel
// reached, kSkipBlocks: skip entries that a subgroup's pixels cannot see. Subgroups of at least 8, without idle lanes.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_vote : require
#include "blend.glsl"
#include "blend_blocks.glsl"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendDepthId) const bool kDepth = false;
layout(constant_id = kBlendAbsoluteId) const bool kAbsolute = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendContributionsId) const bool kContributions = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(constant_id = kBlendCutId) const bool kCut = false;
layout(constant_id = kBlendEarlyOutId) const bool kEarlyOut = false;
layout(constant_id = kBlendSkipBlocksId) const bool kSkipBlocks = false;
layout(constant_id = kBlendMaxSubgroupsId) const uint kMaxSubgroups = 32;
layout(set = 0, binding = 0, std430) readonly buffer Splats { vec4 splats[]; };
layout(set = 0, binding = 1, std430) readonly buffer Pairs { uvec2 pairs[]; };
layout(set = 0, binding = 2, std430) readonly buffer Slots { uint slots[]; };
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
TABLE(4, background);
layout(set = 0, binding = 5, std430) readonly buffer State { vec2 state[]; };
layout(set = 0, binding = 6, std430) readonly buffer GradImage { vec4 grad_image[]; };
layout(set = 0, binding = 7, std430) readonly buffer GradDepth { float grad_depth[]; };
layout(set = 0, binding = 8, std430) buffer Records { vec4 records[]; };  // accumulates
layout(push_constant) uniform Push { BlendParams params; };

const uint kRecordQuads = kContributions ? 4 : 3;
const uint kFloats = 4 * kRecordQuads;
// Entries of a batch; sums have at most 12 KiB, as some devices have 16 KiB.
const uint kBatch = kMaxSubgroups * kRecordQuads <= 24 ? 32 : 768 / (kMaxSubgroups * kRecordQuads);
shared vec4 staged[3 * kBatch];
shared float sums[kBatch * kMaxSubgroups * kFloats];
shared uint reached[kMaxSubgroups];  // a bit for each entry of the batch that has sums
shared uint last_entry;

struct Pixel {
    vec2 centre;
    vec4 g;
    uint stop;
    float t, behind;
};

// What pixels of a subgroup see: its box of pixel centres, and the end of its list.
struct Box {
    vec2 low, high;
    uint end;
};

// Sums the components over four lanes, each of which keeps one: x, z, y, w.
float component_sum(vec4 quad) {
    const bool upper = (gl_SubgroupInvocationID & 1u) != 0, second = (gl_SubgroupInvocationID & 2u) != 0;
    const vec2 two = (upper ? quad.zw : quad.xy) + subgroupShuffleXor(upper ? quad.xy : quad.zw, 1u);
    return (second ? two.y : two.x) + subgroupShuffleXor(second ? two.x : two.y, 2u);
}

// Sums the record over the subgroup. Every step halves what a lane keeps, until it has one value of one quad.
void store_sums(uint entry, vec4 first, vec4 second, vec4 third, vec4 fourth) {
    const uint l = gl_SubgroupInvocationID, lanes = gl_WorkGroupSize.x / gl_NumSubgroups;
    const vec4 quads = vec4(component_sum(first), component_sum(second), component_sum(third),
                            kContributions ? component_sum(fourth) : 0.0);
    const bool upper = (l & 4u) != 0, last = (l & 8u) != 0;
    const vec2 two = (upper ? quads.zw : quads.xy) + subgroupShuffleXor(upper ? quads.xy : quads.zw, 4u);
    const uint quad = (upper ? 2u : 0u) + (last ? 1u : 0u);
    const uint place = (entry * kMaxSubgroups + gl_SubgroupID) * kFloats + 4 * quad + 2 * (l & 1u) + (l >> 1 & 1u);
    if (lanes < 16) {
        sums[place] = two.x;
        if (quad + 1 < kRecordQuads) sums[place + 4] = two.y;
        return;
    }
    float sum = (last ? two.y : two.x) + subgroupShuffleXor(last ? two.x : two.y, 8u);
    for (uint step = 16; step < lanes; step <<= 1) sum += subgroupShuffleXor(sum, step);
    if (l < 16 && quad < kRecordQuads) sums[place] = sum;
}

// Walks one staged entry back. Returns false if the subgroup's sums are 0.
bool walk_entry(uint entry, uint i, inout Pixel p) {
    const vec4 a = staged[3 * entry];
    const vec3 l = staged[3 * entry + 1].xyz;
    const vec4 color = vec4(staged[3 * entry + 2].xyz, a.w);
    const vec2 y = whitened_offset(a.xy, l, p.centre);
    precise float raw = density(a.z, log2_weight(y), kCut);
    precise float alpha = min(kAlphaMax, raw);
    alpha = alpha >= kAlphaMin && i < p.stop ? alpha : 0.0;
    if (kEarlyOut && kSkipBlocks && !subgroupAny(alpha > 0.0)) return false;
    if (alpha > 0.0) p.t /= 1.0 - alpha;
    const float w = alpha * p.t;
    const float e = dot(color, p.g) - p.behind;
    p.behind += alpha * e;
    const float passed = params.straight_through != 0 ? (alpha > 0.0 ? raw * p.t : 0.0) : w;
    const float v = raw <= kAlphaMax || params.straight_through != 0 ? passed * e : 0.0;
    vec2 slope = vec2(0);
    if (kAbsolute) slope = abs(v * vec2(l.x * y.x, l.y * y.x + l.z * y.y)) * kTwoLn2;
    store_sums(entry, vec4(v, v * y, v * y.x * y.x), vec4(v * y.x * y.y, v * y.y * y.y, slope), w * p.g,
               vec4(w, w > 0.0 ? 1 : 0, 0, 0));
    return true;
}

// Walks `count` staged entries from `begin` on, the last one first. Lanes test one each before. Returns `reached`.
uint walk_batch(uint begin, uint count, Box box, inout Pixel p) {
    const uint lanes = min(gl_WorkGroupSize.x / gl_NumSubgroups, 32u);
    uint found = 0;
    for (uint from = (count - 1) / lanes * lanes; from < count; from -= lanes) {  // ends below 0
        const uint own = from + gl_SubgroupInvocationID, entry = min(own, count - 1);
        const vec2 mean = staged[3 * entry].xy;
        const bool sees = !kSkipBlocks || reaches_box(box.low - mean, box.high - mean, staged[3 * entry + 1]);
        uint left = subgroupBallot(own < count && begin + own < box.end && sees).x;
        while (left != 0) {
            const uint bit = uint(findMSB(left));
            left ^= 1u << bit;
            if (walk_entry(from + bit, begin + from + bit, p)) found |= 1u << (from + bit);
        }
    }
    return found;
}

// One value of a record, over the subgroups in order, with what rounding lost: a plain sum of 32 exceeds the tolerance
// of the gradients. Sums of 0 change no bit.
float subgroups_sum(uint entry, uint k) {
    precise float sum = 0, lost = 0;
    for (uint s = 0; s < gl_NumSubgroups; ++s) {
        if ((reached[s] >> entry & 1u) == 0) continue;
        precise float term = sums[(entry * kMaxSubgroups + s) * kFloats + k];
        precise float next = sum + term;
        precise float added = next - sum;
        lost += (sum - (next - added)) + (term - added);
        sum = next;
    }
    precise float all = sum + lost;
    return all;
}

void main() {
    if (gl_NumSubgroups > kMaxSubgroups) return;  // see radix_sort_downsweep_gpu.comp
    const uint lane = gl_LocalInvocationID.x;
    const uvec2 tile = uvec2(gl_WorkGroupID.x, gl_WorkGroupID.y);
    const uint view = gl_WorkGroupID.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 at = pixel_of(lane);
    const uvec2 size = kSizes ? uvec2(TABLE4(background, 1 + view).xy) : uvec2(params.width, params.height);
    const bool inside = corner.x + at.x < size.x && corner.y + at.y < size.y;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    uvec2 part;
    const bool some = walks(kParts, range, params.part_begin, params.part_entries, part);
    if (kParts && !some) return;
    const uint pixel = (view * params.height + corner.y + at.y) * params.width + corner.x + at.x;

    Pixel p = Pixel(vec2(at) + 0.5, inside ? grad_image[pixel] : vec4(0), 0, 0, 0);
    p.behind = dot(TABLE4(background, 0).rgb, p.g.rgb) - p.g.w;
    p.g.w = kDepth && inside ? grad_depth[pixel] : 0.0;
    const vec2 end = inside ? state[pixel] : vec2(0);
    p.t = end.x;
    p.stop = range.x + uint(end.y);
    const uint carry = kParts ? slots[range.x + lane] * kRecordQuads : 0;
    if (kParts && part.y < range.y) {
        p.t = records[carry].x;
        p.behind = records[carry].y;
    }

    const uint seen = kEarlyOut ? p.stop : part.y;
    const Box box = Box(subgroupMin(p.centre), subgroupMax(p.centre), subgroupMax(seen));
    if (lane == 0) last_entry = range.x;
    barrier();
    if (subgroupElect()) atomicMax(last_entry, box.end);
    barrier();
    const uint walked = clamp(last_entry, part.x, part.y);
    for (uint i = walked + lane; i < part.y; i += gl_WorkGroupSize.x) {
        const uint to = slots[i] * kRecordQuads;
        for (uint k = 0; k < kRecordQuads; ++k) records[to + k] = vec4(0);
    }
    for (uint i = walked; i > part.x;) {
        const uint count = min(kBatch, i - part.x);
        i -= count;
        for (uint k = lane; k < 3 * count; k += gl_WorkGroupSize.x) {
            const vec4 quad = splats[pairs[i + k / 3].y * 3 + k % 3];
            staged[k] = k % 3 == 0 ? quad - vec4(corner, 0, 0) : quad;
        }
        barrier();
        const uint found = walk_batch(i, count, box, p);
        if (subgroupElect()) reached[gl_SubgroupID] = found;
        barrier();
        for (uint k = lane; k < count * kFloats; k += gl_WorkGroupSize.x) {
            const uint entry = k / kFloats, of = k % kFloats;
            records[slots[i + entry] * kRecordQuads + of / 4][of % 4] = subgroups_sum(entry, of);
        }
    }
    if (kParts && part.x > range.x) records[carry] = vec4(p.t, p.behind, 0, 0);
}
