#version 460
// Gradient of blend_forward.comp with respect to the splats: one record per (tile, Gaussian). Each goes to its
// pair's slot, so that a Gaussian's records are contiguous.
//   e_i = c_i . g - D_i,  D_(i-1) = D_i + alpha_i e_i,  D_last = background . g - g_alpha
//   (T_i D_i is what lies behind i, weighted by g);  v = w_i e_i = alpha_i dL/dalpha_i
// Record: sums over the tile's pixels, y = L^T (mean - pixel centre), L scaled as in the splats:
//   (v, v y1, v y2, v y1^2), (v y1 y2, v y2^2, |dL/du|, |dL/dv|), (w g_rgb, w g_depth), (w, pixels with w > 0, 0, 0)
// One workgroup computes a tile (gl_WorkGroupID.z is the view), one invocation a pixel.
// Bindings: splats, pairs uvec2 (tile, item; sorted), slots, ranges, background [1+V], state, grad_image
// [V,H,W] vec4, grad_depth [V,H,W]; records [pairs][3 or 4] vec4.
// Specialisation: kDepth: grad_depth is given, kAbsolute: absolute sums, kSizes: views have their own sizes,
// kContributions: records have the fourth vec4, kParts: walk a part of each long list; before the first one, the record
// of entry i is (T, D) of pixel i. Workgroup of kTileSize^2 invocations.
// T is divided at most 2350 times, as a pixel stops at 1e-4 and each alpha divided by is at least 1/255.
#extension GL_GOOGLE_include_directive : require
#include "blend.glsl"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendDepthId) const bool kDepth = false;
layout(constant_id = kBlendAbsoluteId) const bool kAbsolute = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendContributionsId) const bool kContributions = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(constant_id = kBlendCutId) const bool kCut = false;
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

#include "reduce.glsl"

const uint kRecordQuads = kContributions ? 4 : 3;

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uvec2 tile = uvec2(gl_WorkGroupID.x, gl_WorkGroupID.y);
    const uint view = gl_WorkGroupID.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 at = uvec2(lane % kTileSize, lane / kTileSize);
    const uvec2 size = kSizes ? uvec2(TABLE4(background, 1 + view).xy) : uvec2(params.width, params.height);
    const bool inside = corner.x + at.x < size.x && corner.y + at.y < size.y;
    const vec2 centre = vec2(at) + 0.5;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    uvec2 part;
    const bool some = walks(kParts, range, params.part_begin, params.part_entries, part);
    if (kParts && !some) return;
    const uint pixel = (view * params.height + corner.y + at.y) * params.width + corner.x + at.x;

    vec4 g = inside ? grad_image[pixel] : vec4(0);
    float behind = dot(TABLE4(background, 0).rgb, g.rgb) - g.w;
    g.w = kDepth && inside ? grad_depth[pixel] : 0.0;
    const vec2 end = inside ? state[pixel] : vec2(0);
    float t = end.x;
    const uint stop = range.x + uint(end.y);
    const uint carry = kParts ? slots[range.x + lane] * kRecordQuads : 0;
    if (kParts && part.y < range.y) {
        t = records[carry].x;
        behind = records[carry].y;
    }

    for (uint i = part.y; i > part.x;) {
        --i;
        const uint slot = slots[i];
        const uint item = pairs[i].y;
        const vec4 a = splats[item * 3] - vec4(corner, 0, 0);
        const vec3 l = splats[item * 3 + 1].xyz;
        const vec4 color = vec4(splats[item * 3 + 2].xyz, a.w);
        const vec2 y = whitened_offset(a.xy, l, centre);
        precise float raw = density(a.z, log2_weight(y), kCut);
        precise float alpha = min(kAlphaMax, raw);
        alpha = alpha >= kAlphaMin && i < stop ? alpha : 0.0;
        if (alpha > 0.0) t /= 1.0 - alpha;
        const float w = alpha * t;
        const float e = dot(color, g) - behind;
        behind += alpha * e;
        const float passed = params.straight_through != 0 ? (alpha > 0.0 ? raw * t : 0.0) : w;
        const float v = raw <= kAlphaMax || params.straight_through != 0 ? passed * e : 0.0;
        vec2 slope = vec2(0);
        if (kAbsolute) slope = abs(v * vec2(l.x * y.x, l.y * y.x + l.z * y.y)) * kTwoLn2;
        const vec4 first = workgroup_sum(vec4(v, v * y, v * y.x * y.x));
        const vec4 second = workgroup_sum(vec4(v * y.x * y.y, v * y.y * y.y, slope));
        const vec4 third = workgroup_sum(w * g);
        vec4 fourth = vec4(0);
        if (kContributions) fourth = workgroup_sum(vec4(w, w > 0.0 ? 1 : 0, 0, 0));
        if (lane == 0) {
            records[slot * kRecordQuads] = first;
            records[slot * kRecordQuads + 1] = second;
            records[slot * kRecordQuads + 2] = third;
            if (kContributions) records[slot * kRecordQuads + 3] = fourth;
        }
    }
    if (kParts && part.x > range.x) records[carry] = vec4(t, behind, 0, 0);
}
