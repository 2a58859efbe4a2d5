#version 460
// Draws triangles into samples: first the least depth of each, then the least number of the triangles at that depth, so
// the order of triangles changes nothing. One invocation draws the samples of one tile of 8 x 8 pixels within one
// triangle's box; the sums of the counts of tiles tell which.
// Bindings: view (a table), vertices, corners, corner_texcoords [T,3 or 4], attributes, texels, sums, boxes, as
// triangle_bin.comp and triangle_shade.comp have them; samples: depths of all, then numbers.
// Specialisation: kTransparent: points of some materials may not be there.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/triangles/triangle_params.h"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kTriangleTransparentId) const bool kTransparent = false;
TABLE(0, view);
UINT_QUADS(1, vertices);
UINT_QUADS(2, corners);
UINTS(3, corner_texcoords);
UINTS(4, attributes);
UINTS(5, texels);
UINTS(6, sums);
UINT_QUADS(7, boxes);
layout(set = 0, binding = 8, std430) buffer Samples { uint samples[]; };  // accumulates
layout(push_constant) uniform Push { TriangleParams params; };

#include "launch.glsl"
#include "triangles/setup.glsl"
#include "triangles/surface.glsl"

// The first element above `rest` of the run of level `begin` that has number `run`; `rest` loses what comes before it.
uint step_down(uint begin, uint count, uint run, inout uint rest) {
    const uint first = run << kSumsBits;
    uint low = first, size = min(count - first, 1u << kSumsBits);
    for (uint bit = 0; bit <= kSumsBits; ++bit) {
        const uint half_size = size / 2;
        const bool above = size > 0 && LD1(sums, begin + low + half_size) <= rest;
        low = above ? low + half_size + 1 : low;
        size = above ? size - half_size - 1 : half_size;
    }
    if (low > first) rest -= LD1(sums, begin + low - 1);
    return low;
}

uint runs(uint count) { return (count + (1u << kSumsBits) - 1) >> kSumsBits; }

// The triangle of the range that has a pair; `rest` becomes the pair's number among its own.
uint triangle_of_pair(inout uint rest) {
    const uint count1 = runs(params.count), count2 = runs(count1), count3 = runs(count2);
    uint at = step_down(params.level3, count3, 0, rest);
    at = step_down(params.level2, count2, at, rest);
    at = step_down(params.level1, count1, at, rest);
    return step_down(0, params.count, at, rest);
}

// Samples of a tile in a box, at first + step i: columns and rows, first and last. None: the last is less.
ivec4 samples_of(ivec4 box, ivec2 tile, int first, int step) {
    const ivec2 low = max(max(box.xy, tile), ivec2(first));
    const ivec2 high = min(box.zw, tile + int(kTriangleTile * kSubpixels) - 1) - first;
    const ivec2 last = ivec2(high.x < 0 ? -1 : high.x / step, high.y < 0 ? -1 : high.y / step);
    return ivec4((low - first + step - 1) / step, last);
}

int count_of(ivec4 range) { return max(range.z - range.x + 1, 0) * max(range.w - range.y + 1, 0); }

void main() {
    uint rest = params.pairs_begin + invocation_index(params.groups_x);
    if (rest >= params.pairs_end) return;
    const uint i = triangle_of_pair(rest);
    const uvec4 stored = LDU4(boxes, i);
    const ivec4 box = ivec4(stored);
    const uvec4 tiles = stored / (kTriangleTile * kSubpixels);
    const uint columns = tiles.z - tiles.x + 1;
    const ivec2 tile = ivec2(tiles.xy + uvec2(rest % columns, rest / columns)) * int(kTriangleTile * kSubpixels);

    const int fine = int(kSubpixels / max(params.samples, 1u)), whole = int(kSubpixels);
    const ivec4 grid = samples_of(box, tile, fine / 2, fine);
    const ivec4 centers = samples_of(box, tile, whole / 2, whole);
    const int in_grid = params.samples != 0 ? count_of(grid) : 0;
    const int all = in_grid + (params.centers != 0 ? count_of(centers) : 0);
    if (all == 0) return;

    const uint number = params.first + i;
    const uvec4 corner = LDU4(corners, number);
    const Corner a = corner_of(corner.x), b = corner_of(corner.y), c = corner_of(corner.z);
    const Triangle triangle = triangle_of(a, b, c, tile);
    const uint material = material_at(corner.w);
    const bool both_sides = (LD1(texels, material + kMaterialBits) >> kDoubleSidedBit & 1u) != 0;
    const vec3 normal = cross(b.vertex - a.vertex, c.vertex - a.vertex);
    const uint pixels = params.width * (params.row_end - params.row_begin);
    const uint per_pixel = params.samples * params.samples;
    const uint total = pixels * (per_pixel + params.centers);

    bool fine_ones = in_grid > 0;
    ivec4 range = fine_ones ? grid : centers;
    ivec2 at = range.xy;
    int left = all;
    do {
        const int step = fine_ones ? fine : whole;
        const ivec2 subpixel = at * step + step / 2;
        const Hit hit = hit_at(triangle, subpixel.x - tile.x, subpixel.y - tile.y);
        const uvec2 pixel = uvec2(subpixel) / kSubpixels;
        const uint in_band = (pixel.y - params.row_begin) * params.width + pixel.x;
        const uvec2 within = uvec2(at) - pixel * params.samples;
        const uint to = fine_ones ? in_band * per_pixel + within.y * params.samples + within.x
                                  : pixels * per_pixel + in_band;
        bool there = hit.inside && (hit.front || both_sides);
        if (kTransparent) {
            const float spread = spread_of(normal, vec2(subpixel) / float(kSubpixels), hit.z);
            const float opacity = base_color(corner, number, hit.weights, spread).w;
            there = there && is_there(material, opacity, fine_ones ? float(spread_place(within, params.samples)) : 0.0,
                                      fine_ones ? float(per_pixel) : 1.0);
        }
        const uint depth = floatBitsToUint(hit.z);
        if (there) {
            if (params.numbers == 0) atomicMin(samples[to], depth);
            else if (samples[to] == depth) atomicMin(samples[total + to], number);
        }
        at.x += 1;
        if (at.x > range.z) at = ivec2(range.x, at.y + 1);
        if (fine_ones && at.y > range.w) {
            fine_ones = false;
            range = centers;
            at = range.xy;
        }
    } while (--left > 0);
}
