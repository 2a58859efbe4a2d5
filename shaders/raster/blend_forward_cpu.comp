#version 460
// Like blend_forward.comp, for devices whose shaders run on a CPU, almost without branches. 8 lanes take
// 8 columns of a tile and kRows rows each. They test 8 list entries at a time, one per lane, collect those
// that can reach the 8 x 8 block, and blend them 8 at a time, passed round by constant shuffles. Needs a
// workgroup of one subgroup of at least 8.
// One workgroup computes 8 columns by kRows rows of a tile, which spread_tile.glsl chooses. In x there are
// 16 * 16 / (8 * kRows) workgroups per tile of a row, in y the rows of tiles, in z the views.
// Bindings and specialisation as blend_forward.comp; kSkipBlocks: skip entries that cannot reach the block.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_vote : require
#include "blend.glsl"
#include "load.glsl"
#include "store.glsl"
#include "blend_blocks.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendExtraId) const bool kExtra = false;
layout(constant_id = kBlendNormalsId) const bool kNormals = false;
layout(constant_id = kBlendEarlyOutId) const bool kEarlyOut = false;
layout(constant_id = kBlendSkipBlocksId) const bool kSkipBlocks = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendIdsId) const bool kIds = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(constant_id = kBlendCutId) const bool kCut = false;
layout(constant_id = kBlendMedianId) const bool kMedian = false;
layout(constant_id = kBlendRaysId) const bool kRays = false;
QUADS(0, splats);
UINTS(1, pairs);
QUADS(2, normals);
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
QUADS(4, background);
CARRIED(5, image, u64vec2, vec4);
CARRIED(6, state, uint64_t, uvec2);
CARRIED(7, extra, u64vec2, vec4);
layout(set = 0, binding = 8, std430) buffer Median { float median[]; };  // accumulates
UINTS(9, order);
layout(push_constant) uniform Push { BlendParams params; };

#include "raster/spread_tile.glsl"

const int kRows = 8;

// Collected list entries in the order of the lanes: the first 8, and those after them.
struct Waiting {
    uint count;
    uint entries, next_entries;
};

// Position of the set bit of an octet that has n set bits before it; undefined if there is none.
uint place_of_bit(uint bits, int n) {
    [[unroll]] for (int s = 0; s < 7; ++s) bits = s < n ? bits & (bits - 1) : bits;
    return uint(findLSB(bits));
}

// Test list entries from `seen` on until 8 are collected, or the list ends.
void look_ahead(uvec2 range, vec2 low, uint lane, inout uint seen, inout Waiting waiting) {
    if (seen >= range.y || waiting.count >= 8) return;
    do {
        const uint mine = min(seen + lane, range.y - 1);
        const uint candidate = LD1(pairs, 2 * mine + 1);
        const vec2 mean = LD4(splats, candidate * 3).xy;
        const vec4 b = LD4(splats, candidate * 3 + 1);
        const bool reaches = kRays ? boxes_meet(low, low + 7.0, b) : reaches_block(low, mean, b);
        const bool keep = seen + lane < range.y && (!kSkipBlocks || reaches);
        const uint kept = subgroupBallot(keep).x & 0xFFu;
        const int before = int(lane) - int(waiting.count);  // index among the kept entries
        if (before >= 0) waiting.entries = seen + place_of_bit(kept, before);
        waiting.next_entries = seen + place_of_bit(kept, before + 8);
        waiting.count += bitCount(kept);
        seen += 8;
    } while (seen < range.y && waiting.count < 8);
}

// 0 below kAlphaMin, at most kAlphaMax. Uses a comparison, as lavapipe's min also tests for NaN.
float limit_alpha(float raw) {
    const float seen = raw >= kAlphaMin ? raw : 0.0;
    return seen > kAlphaMax ? kAlphaMax : seen;
}

// The numbers of lane j.
vec4 shuffled(vec4 v, uint j) {
    return vec4(subgroupShuffle(v.x, j), subgroupShuffle(v.y, j), subgroupShuffle(v.z, j), subgroupShuffle(v.w, j));
}

struct Pixel {
    float t;  // transmittance, negated once the pixel has stopped
    float entries, contributors, depth;
    float largest, id;  // the largest weight and its Gaussian
    float median;
    vec3 color;
};

// What of a list entry does not depend on the pixel, and its number in the list.
struct Layer {
    vec3 rgb;
    float index, depth, id;
};

void blend(inout Pixel p, float alpha, Layer layer, float stop_below) {
    const float next = p.t - p.t * alpha;
    const bool stop = next < stop_below;
    const float w = stop ? 0.0 : alpha * p.t;
    if (kMedian) p.median = w > 0.0 && p.t > kMedianTransmittance ? layer.depth : p.median;
    p.t = stop ? -abs(p.t) : next;
    p.color += w * layer.rgb;
    p.entries = stop ? p.entries : layer.index;
    if (kExtra) {
        p.depth += w * layer.depth;
        p.contributors += w > 0.0 ? 1.0 : 0.0;
    }
    if (kIds) {
        p.id = w > p.largest ? layer.id : p.id;
        p.largest = w > p.largest ? w : p.largest;
    }
}

// What the part before left; image is (rgb, T), T as in Pixel.
Pixel carried_pixel(uint at) {
    const vec4 sums = image_plain[at];
    const vec4 more = kExtra ? extra_plain[at] : vec4(0);
    return Pixel(sums.a, kNormals ? 0.0 : uintBitsToFloat(state_plain[at].y), more.z, more.x, more.y, more.w,
                 kMedian ? median[at] : 0.0, sums.rgb);
}

void carry_pixel(uint at, Pixel p) {
    ST4(image, at, vec4(p.color, p.t));
    if (!kNormals) ST2(state, at, floatBitsToUint(vec2(abs(p.t), p.entries)));
    if (kExtra) ST4(extra, at, vec4(p.depth, p.largest, p.contributors, p.id));
    if (kMedian) median[at] = p.median;
}

void write_pixel(uint at, Pixel p, vec3 behind) {
    const float left = abs(p.t);
    ST4(image, at, vec4(p.color + left * behind, 1.0 - left));
    if (!kNormals) ST2(state, at, floatBitsToUint(vec2(left, p.entries)));
    if (kExtra) {
        const float expected = p.depth / max(1.0 - left, kExpectedAlphaMin);
        ST4(extra, at, vec4(p.depth, expected, p.contributors, kIds ? p.id : 0.0));
    }
    if (kMedian) median[at] = p.median;
}

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uvec4 work = spread_tile(4);
    const uvec2 tile = work.xy;
    const uint view = work.z, part = work.w;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 at = uvec2((part & 1u) * 8u + lane, (part >> 1) * uint(kRows));
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    uvec2 walked;
    if (!walks(kParts, range, params.part_begin, params.part_entries, walked)) return;
    const float x = float(at.x) + 0.5, y = float(at.y) + 0.5;
    const float stop_below = params.stop_below;
    const uvec2 size = kSizes ? uvec2(LD4(background, 1 + view).xy) : uvec2(params.width, params.height);
    const bool column_inside = corner.x + at.x < size.x;

    Pixel pixels[kRows];
    [[unroll]] for (int r = 0; r < kRows; ++r) {
        const bool inside = column_inside && corner.y + at.y + uint(r) < size.y;
        pixels[r] = Pixel(inside ? 1.0 : -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, vec3(0));
        const uvec2 to = corner + at + uvec2(0, r);
        if (kParts && params.part_begin > 0 && to.x < params.width && to.y < params.height)
            pixels[r] = carried_pixel((view * params.height + to.y) * params.width + to.x);
    }
    const vec2 low = vec2(corner) + vec2(at.x - lane, at.y) + 0.5;
    const uint first_item = kIds ? item_of_first(view, params.gaussians, LD4(background, 1 + view)) : 0;
    uint seen = walked.x;
    Waiting waiting = Waiting(0, 0, 0);
    bool stopped = false;
    if (seen < walked.y) do {
        look_ahead(walked, low, lane, seen, waiting);
        const bool filled = lane < waiting.count;
        const uint entry = filled ? waiting.entries : range.x;
        waiting = Waiting(waiting.count - min(waiting.count, 8u), waiting.next_entries, 0);
        const uint item = LD1(pairs, 2 * entry + 1);
        const vec4 a = LD4(splats, item * 3) - vec4(corner, 0, 0);
        const vec4 b = LD4(splats, kRays ? params.rays + item * 2 : item * 3 + 1);
        const vec4 e = kRays ? LD4(splats, params.rays + item * 2 + 1) : vec4(0);
        const vec4 c = kNormals ? LD4(normals, item) : LD4(splats, item * 3 + 2);
        const float opacity = filled ? a.z : 0.0;
        const float number = kIds ? float(item - first_item) : 0.0;
        const float place = float(filled ? entry - range.x + 1u : walked.y - range.x);
        [[unroll]] for (uint j = 0; j < 8; ++j) {
            const float o = subgroupShuffle(opacity, j);
            const vec4 l = shuffled(b, j);
            Layer layer;
            layer.rgb = vec3(subgroupShuffle(c.x, j), subgroupShuffle(c.y, j), subgroupShuffle(c.z, j));
            layer.index = subgroupShuffle(place, j);
            layer.depth = kExtra || kMedian || kRays ? subgroupShuffle(a.w, j) : 0.0;
            layer.id = kIds ? subgroupShuffle(number, j) : 0.0;
            const vec4 ray = kRays ? shuffled(e, j) : vec4(0);
            const float my = subgroupShuffle(a.y, j), z = layer.depth;
            precise float qx = subgroupShuffle(a.x, j) - x;
            precise float ux = l.x * qx;
            [[unroll]] for (int r = 0; r < kRows; ++r) {
                precise float qy = my - (y + float(r));
                precise float u = ux + l.y * qy;
                precise float v = l.z * qy;
                precise float power = -(u * u + v * v);
                if (kRays) power = ray_maximum(vec2(qx, qy), l, ray, z, params.near_plane, layer.depth);
                precise float raw = density(o, power, kCut);
                blend(pixels[r], limit_alpha(raw), layer, stop_below);
            }
        }
        if (kEarlyOut) {
            float most = pixels[0].t;
            [[unroll]] for (int r = 1; r < kRows; ++r) most = max(most, pixels[r].t);
            stopped = subgroupAll(most <= 0.0);
        }
    } while (!stopped && (seen < walked.y || waiting.count > 0));
    if (!(kSizes ? corner.x + at.x < params.width : column_inside)) return;
    const vec3 behind = kNormals ? vec3(0) : LD4(background, 0).rgb;
    [[unroll]] for (uint r = 0; r < uint(kRows); ++r) {
        if (corner.y + at.y + r < params.height) {
            const uint pixel = (view * params.height + corner.y + at.y + r) * params.width + corner.x + at.x;
            const bool beyond = kSizes && !(column_inside && corner.y + at.y + r < size.y);
            if (kParts && walked.y < range.y) carry_pixel(pixel, pixels[r]);
            else write_pixel(pixel, pixels[r], beyond ? vec3(0) : behind);
        }
    }
}
