#version 460
// The box of each triangle of a range in a band of the image, and how many tiles it meets: 0 where it has no sample.
// One invocation computes one triangle. Boxes are a little too large, so that rounding leaves out no sample.
// Bindings: view (a table), vertices uvec4 [V] (x, y, z, 0), corners uvec4 [T] (vertices, material); counts [T], boxes
// uvec4 [T]: the first and the last subpixels, from the image's upper left corner.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/triangles/triangle_params.h"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
TABLE(0, view);
UINT_QUADS(1, vertices);
UINT_QUADS(2, corners);
layout(set = 0, binding = 3, std430) writeonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Boxes { uvec4 boxes[]; };
layout(push_constant) uniform Push { TriangleParams params; };

#include "launch.glsl"
#include "triangles/setup.glsl"

// Beyond this a box is wider than any image, which ends 2^17 subpixels from the middle.
const float kFar = 1048576;

struct Box {
    vec2 low, high;
};

void add_point(inout Box box, vec3 at) {
    const vec2 point = at.xy / at.z * TABLE4(view, kViewScale).y;
    box.low = min(box.low, point);
    box.high = max(box.high, point);
}

// The point of an edge at depth `z`, if its ends lie on both sides.
void add_cut(inout Box box, vec3 a, vec3 b, float z) {
    if ((a.z < z) == (b.z < z)) return;
    add_point(box, vec3(mix(a.xy, b.xy, (z - a.z) / (b.z - a.z)), z));
}

// Samples at first + step i, in units of subpixels, of a box.
ivec2 sample_range(int low, int high, int first, int step) {
    return ivec2((low - first + step - 1) / step, (high - first) / step);  // low >= 0, high >= first
}

bool has_samples(ivec4 box, int first, int step) {
    if (box.z < first || box.w < first) return false;
    const ivec2 columns = sample_range(max(box.x, first), box.z, first, step);
    const ivec2 rows = sample_range(max(box.y, first), box.w, first, step);
    return columns.x <= columns.y && rows.x <= rows.y;
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.count) return;
    const uvec4 corner = LDU4(corners, params.first + i);
    const vec3 a = vec3(corner_of(corner.x).at), b = vec3(corner_of(corner.y).at), c = vec3(corner_of(corner.z).at);
    const float near = max(floor(TABLE4(view, kViewScale).x), 1.0);
    Box box = Box(vec2(kFar), vec2(-kFar));
    if (a.z >= near) add_point(box, a);
    if (b.z >= near) add_point(box, b);
    if (c.z >= near) add_point(box, c);
    add_cut(box, a, b, near);
    add_cut(box, b, c, near);
    add_cut(box, c, a, near);
    // Quotients err by 2^-21 of themselves at most, cuts by 2 units of X and Y besides.
    const bool cut = min(min(a.z, b.z), c.z) < near;
    const float slack = 0.25 + (cut ? 4 * TABLE4(view, kViewScale).y / near : 0);
    const vec2 low = clamp(box.low - abs(box.low) * 4e-6 - slack, -kFar, kFar) + vec2(middle());
    const vec2 high = clamp(box.high + abs(box.high) * 4e-6 + slack, -kFar, kFar) + vec2(middle());
    const vec2 first = vec2(0, float(params.row_begin * kSubpixels));
    const vec2 last = vec2(float(params.width * kSubpixels), float(params.row_end * kSubpixels)) - 1;
    const ivec4 inside = ivec4(ceil(max(low, first)), floor(min(high, last)));
    uint count = 0;
    if (inside.x <= inside.z && inside.y <= inside.w) {
        const int step = int(kSubpixels / max(params.samples, 1u));
        const bool seen = (params.samples != 0 && has_samples(inside, step / 2, step)) ||
                          (params.centers != 0 && has_samples(inside, int(kSubpixels / 2), int(kSubpixels)));
        const uvec4 tiles = uvec4(inside) / (kTriangleTile * kSubpixels);
        if (seen) count = (tiles.z - tiles.x + 1) * (tiles.w - tiles.y + 1);
    }
    counts[i] = count;
    boxes[i] = uvec4(inside);
}
