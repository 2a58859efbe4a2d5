#version 460
// Like blend_backward.comp, for devices whose shaders run on a CPU. 8 lanes take the four blocks of 8 x 8 pixels
// of a tile one after the other, one column per lane. They test 8 list entries at once, one per lane, and pass
// those that can reach the block to all lanes in turn. A lane sums its pixels, a butterfly sums the lanes, and
// the entry's lane sums the blocks. Needs subgroups of at least 8.
// One workgroup computes a tile, which spread_tile.glsl chooses. Bindings and specialisation as
// blend_backward.comp, but each vec4 of the records is an array, record_a to record_c, and the fourth [pairs] vec2,
// record_d, so that bindings hold more of them; and order. kEarlyOut: skip entries that no pixel reached;
// kSkipBlocks: skip entries that cannot reach a block; kStraightThrough: the gradient passes the limit of alpha, as
// params.straight_through says there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "blend.glsl"
#include "load.glsl"
#include "store.glsl"
#include "blend_blocks.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendDepthId) const bool kDepth = false;
layout(constant_id = kBlendAbsoluteId) const bool kAbsolute = false;
layout(constant_id = kBlendEarlyOutId) const bool kEarlyOut = false;
layout(constant_id = kBlendSkipBlocksId) const bool kSkipBlocks = false;
layout(constant_id = kBlendStraightThroughId) const bool kStraightThrough = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendContributionsId) const bool kContributions = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(constant_id = kBlendCutId) const bool kCut = false;
QUADS(0, splats);
UINTS(1, pairs);
UINTS(2, slots);
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
QUADS(4, background);
layout(set = 0, binding = 5, std430) readonly buffer State { vec2 state[]; };
QUADS(6, grad_image);
layout(set = 0, binding = 7, std430) readonly buffer GradDepth { float grad_depth[]; };
CARRIED(8, record_a, u64vec2, vec4);
QUADS_OUT(9, record_b);
QUADS_OUT(10, record_c);
PAIRS_OUT(11, record_d);
UINTS(12, order);
layout(push_constant) uniform Push { BlendParams params; };

#include "raster/spread_tile.glsl"

const int kRows = 8;
const int kBlocks = 4;
const int kPixels = kBlocks * kRows;
const uint kSums = 14;

// Per pixel of the lane, block by block: transmittance, D, gradients, entries before the stop.
float t[kPixels], behind[kPixels], g_r[kPixels], g_g[kPixels], g_b[kPixels], g_z[kPixels], stop[kPixels];

// A list entry: its splat, with the mean relative to the tile's corner, and its position in the list.
struct Entry {
    vec4 a;  // mean, opacity, depth
    vec4 l;  // l11, l21, l22, reach
    vec3 rgb;
    float place;
};

Entry load_entry(uint at, uvec2 corner, uint place) {
    const uint item = LD1(pairs, 2 * at + 1);
    return Entry(LD4(splats, item * 3) - vec4(corner, 0, 0), LD4(splats, item * 3 + 1),
                 LD4(splats, item * 3 + 2).rgb, float(place));
}

Entry of_lane(Entry e, uint lane) {
    e.a = vec4(subgroupShuffle(e.a.x, lane), subgroupShuffle(e.a.y, lane), subgroupShuffle(e.a.z, lane),
               kDepth ? subgroupShuffle(e.a.w, lane) : 0.0);
    e.l = vec4(subgroupShuffle(e.l.x, lane), subgroupShuffle(e.l.y, lane), subgroupShuffle(e.l.z, lane), 0);
    e.rgb = vec3(subgroupShuffle(e.rgb.r, lane), subgroupShuffle(e.rgb.g, lane), subgroupShuffle(e.rgb.b, lane));
    e.place = subgroupShuffle(e.place, lane);
    return e;
}

float lanes_sum(float v) {
    v += subgroupShuffleXor(v, 1u);
    v += subgroupShuffleXor(v, 2u);
    v += subgroupShuffleXor(v, 4u);
    return v;
}

// First pixel of a block, relative to the tile's.
uvec2 block_at(int block) { return uvec2(block & 1, block >> 1) * 8u; }

// One entry over one block: sums over the pixels, which the entry's own lane adds to its record.
void blend_block(const int block, uint lane, Entry e, bool own, inout float record[kSums]) {
    const vec2 first = vec2(block_at(block)) + vec2(lane, 0) + 0.5;
    precise float qx = e.a.x - first.x;
    precise float ux = e.l.x * qx;
    vec4 sum_c = vec4(0);
    float m0 = 0.0;
    vec2 m1 = vec2(0);
    vec3 m2 = vec3(0);
    vec2 slope = vec2(0), seen_by = vec2(0);
    [[unroll]] for (int r = 0; r < kRows; ++r) {
        const int q = block * kRows + r;
        precise float qy = e.a.y - (first.y + float(r));
        precise float u = ux + e.l.y * qy;
        precise float w2 = e.l.z * qy;
        precise float power = -(u * u + w2 * w2);
        precise float raw = density(e.a.z, power, kCut);
        const float seen = raw >= kAlphaMin && e.place < stop[q] ? raw : 0.0;
        const bool clamped = seen > kAlphaMax;
        const float alpha = clamped ? kAlphaMax : seen;
        t[q] = alpha > 0.0 ? t[q] / (1.0 - alpha) : t[q];  // a quotient by 1 need not be exact
        const float w = alpha * t[q];
        float g = e.rgb.r * g_r[q] + e.rgb.g * g_g[q] + e.rgb.b * g_b[q] - behind[q];
        if (kDepth) g += e.a.w * g_z[q];
        behind[q] += alpha * g;
        sum_c.rgb += w * vec3(g_r[q], g_g[q], g_b[q]);
        if (kContributions) seen_by += vec2(w, w > 0.0 ? 1.0 : 0.0);
        if (kDepth) sum_c.a += w * g_z[q];
        const float v = (kStraightThrough ? seen * t[q] : clamped ? 0.0 : w) * g;
        const float vu = v * u, vw = v * w2;
        m0 += v;
        m1 += vec2(vu, vw);
        m2 += vec3(vu * u, vu * w2, vw * w2);
        if (kAbsolute) slope += kTwoLn2 * abs(v * vec2(e.l.x * u, e.l.y * u + e.l.z * w2));
    }
    const float sums[kSums] = float[kSums](m0, m1.x, m1.y, m2.x, m2.y, m2.z, slope.x, slope.y, sum_c.r, sum_c.g,
                                           sum_c.b, sum_c.a, seen_by.x, seen_by.y);
    [[unroll]] for (uint i = 0; i < kSums; ++i) {
        if ((i == 6 || i == 7) && !kAbsolute) continue;
        if (i == 11 && !kDepth) continue;
        if (i >= 12 && !kContributions) continue;
        const float sum = lanes_sum(sums[i]);
        record[i] += own ? sum : 0.0;
    }
}

// Blends back the entries of `kept` (one bit per lane), last first, over a block. e: this lane's entry.
void walk(const int block, uint lane, uint kept, Entry e, inout float record[kSums]) {
    if (kept == 0) return;
    [[dont_unroll]] do {
        const uint from = uint(findMSB(kept));
        const Entry next = of_lane(e, from);
        const bool own = lane == from;
        blend_block(block, lane, next, own, record);
        kept ^= 1u << from;
    } while (kept != 0);
}

// Loads the pixels of block `block`. Returns the number of entries that any of them reached.
float load_block(const int block, uint lane, uvec2 corner, uint view, vec3 background_rgb) {
    const uvec2 size = kSizes ? uvec2(LD4(background, 1 + view).xy) : uvec2(params.width, params.height);
    float last = 0.0;
    [[unroll]] for (int r = 0; r < kRows; ++r) {
        const int q = block * kRows + r;
        const uvec2 at = corner + block_at(block) + uvec2(lane, r);
        const bool inside = at.x < size.x && at.y < size.y;
        const uint pixel = inside ? (view * params.height + at.y) * params.width + at.x : 0u;
        const vec4 g = inside ? LD4(grad_image, pixel) : vec4(0);
        const vec2 end = inside ? state[pixel] : vec2(1, 0);
        g_r[q] = g.r;
        g_g[q] = g.g;
        g_b[q] = g.b;
        g_z[q] = kDepth && inside ? grad_depth[pixel] : 0.0;
        behind[q] = dot(background_rgb, g.rgb) - g.a;
        t[q] = end.x;
        stop[q] = end.y;
        last = max(last, end.y);
    }
    last = max(last, subgroupShuffleXor(last, 1u));
    last = max(last, subgroupShuffleXor(last, 2u));
    return max(last, subgroupShuffleXor(last, 4u));
}

// The record of entry i of the list is (T, D) of pixel i, in the order of t, until its part is walked.
void load_carried(uint first, uint lane) {
    [[unroll]] for (int q = 0; q < kPixels; ++q) {
        const vec2 before = record_a_plain[LD1(slots, first + uint(q) * 8 + lane)].xy;
        t[q] = before.x;
        behind[q] = before.y;
    }
}

void store_carried(uint first, uint lane) {
    [[unroll]] for (int q = 0; q < kPixels; ++q)
        ST4(record_a, LD1(slots, first + uint(q) * 8 + lane), vec4(t[q], behind[q], 0, 0));
}

void store(uint slot, float record[kSums]) {
    ST4(record_a, slot, vec4(record[0], record[1], record[2], record[3]));
    ST4(record_b, slot, vec4(record[4], record[5], record[6], record[7]));
    ST4(record_c, slot, vec4(record[8], record[9], record[10], record[11]));
    if (kContributions) ST2(record_d, slot, floatBitsToUint(vec2(record[12], record[13])));
}

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uvec4 work = spread_tile(1);
    const uvec2 tile = work.xy;
    const uint view = work.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    uvec2 part;
    const bool some = walks(kParts, range, params.part_begin, params.part_entries, part);
    if (kParts && !some) return;
    const vec3 background_rgb = LD4(background, 0).rgb;
    const vec4 last = vec4(load_block(0, lane, corner, view, background_rgb),
                           load_block(1, lane, corner, view, background_rgb),
                           load_block(2, lane, corner, view, background_rgb),
                           load_block(3, lane, corner, view, background_rgb));
    if (kParts && part.y < range.y) load_carried(range.x, lane);
    const uint length = range.y - range.x, begin = part.x - range.x, end = part.y - range.x;
    const uvec4 ends = kEarlyOut ? min(uvec4(last), uvec4(length)) : uvec4(length);
    const uint most = max(max(ends.x, ends.y), max(ends.z, ends.w));
    const uint walked = (clamp(most, begin, end) + 7u) & ~7u;  // parts begin at multiples of 8
    float nothing[kSums];
    [[unroll]] for (uint i = 0; i < kSums; ++i) nothing[i] = 0.0;
    for (uint k = walked; k < end; k += 8)
        if (k + lane < end) store(LD1(slots, range.x + k + lane), nothing);
    for (uint k = walked; k > begin;) {
        k -= 8;
        const uint entry = range.x + min(k + lane, length - 1);
        const Entry mine = load_entry(entry, corner, k + lane);
        uint kept[kBlocks];
        [[unroll]] for (int block = 0; block < kBlocks; ++block) {
            const vec2 first = vec2(block_at(block)) + 0.5;
            const bool wanted =
                k + lane < ends[block] && (!kSkipBlocks || reaches_block(first, mine.a.xy, mine.l));
            kept[block] = subgroupBallot(wanted).x & 0xFFu;
        }
        float record[kSums] = nothing;
        walk(0, lane, kept[0], mine, record);
        walk(1, lane, kept[1], mine, record);
        walk(2, lane, kept[2], mine, record);
        walk(3, lane, kept[3], mine, record);
        if (k + lane < length) store(LD1(slots, entry), record);
    }
    if (kParts && begin > 0) store_carried(range.x, lane);
}
