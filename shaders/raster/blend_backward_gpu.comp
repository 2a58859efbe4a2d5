#version 460
// Like blend_backward.comp, for GPUs: it sums each subgroup, then the subgroups in order, with one barrier
// per list entry. The walk begins at the last entry that any pixel blended.
// Work per workgroup and invocation, bindings and specialisation as there; kEarlyOut: skip entries
// that no pixel reached. Subgroups of at least 8.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require
#include "blend.glsl"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendDepthId) const bool kDepth = false;
layout(constant_id = kBlendAbsoluteId) const bool kAbsolute = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendContributionsId) const bool kContributions = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(constant_id = kBlendEarlyOutId) const bool kEarlyOut = false;
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

const uint kMaxSubgroups = 32;
const uint kRecordQuads = kContributions ? 4 : 3;
shared vec4 sums[2][4][kMaxSubgroups];  // one half is read while the other is filled
shared uint last_entry;

// With Kahan's compensation: a plain sum of 32 exceeds the tolerance of the gradients.
vec4 subgroups_sum(uint side, uint quad) {
    precise vec4 sum = vec4(0), lost = vec4(0);
    for (uint s = 0; s < gl_NumSubgroups; ++s) {
        precise vec4 term = sums[side][quad][s] - lost;
        precise vec4 next = sum + term;
        lost = (next - sum) - term;
        sum = next;
    }
    return sum;
}

void main() {
    if (gl_NumSubgroups > kMaxSubgroups) return;  // see radix_sort_downsweep_gpu.comp
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

    if (lane == 0) last_entry = range.x;
    barrier();
    atomicMax(last_entry, stop);
    barrier();
    const uint walked = kEarlyOut ? clamp(last_entry, part.x, part.y) : part.y;
    for (uint i = walked + lane; i < part.y; i += gl_WorkGroupSize.x) {
        const uint to = slots[i] * kRecordQuads;
        for (uint k = 0; k < kRecordQuads; ++k) records[to + k] = vec4(0);
    }
    for (uint i = walked; i > part.x;) {
        --i;
        const uint slot = slots[i];
        const uint item = pairs[i].y;
        const vec4 a = splats[item * 3] - vec4(corner, 0, 0);
        const vec3 l = splats[item * 3 + 1].xyz;
        const vec4 color = vec4(splats[item * 3 + 2].xyz, a.w);
        const vec2 y = whitened_offset(a.xy, l, centre);
        precise float raw = a.z * exp2(log2_weight(y));
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
        const vec4 first = subgroupAdd(vec4(v, v * y, v * y.x * y.x));
        const vec4 second = subgroupAdd(vec4(v * y.x * y.y, v * y.y * y.y, slope));
        const vec4 third = subgroupAdd(w * g);
        vec4 fourth = vec4(0);
        if (kContributions) fourth = subgroupAdd(vec4(w, w > 0.0 ? 1 : 0, 0, 0));
        const uint side = i & 1u;
        if (subgroupElect()) {
            sums[side][0][gl_SubgroupID] = first;
            sums[side][1][gl_SubgroupID] = second;
            sums[side][2][gl_SubgroupID] = third;
            if (kContributions) sums[side][3][gl_SubgroupID] = fourth;
        }
        barrier();
        if (lane < kRecordQuads) records[slot * kRecordQuads + lane] = subgroups_sum(side, lane);
    }
    if (kParts && part.x > range.x) records[carry] = vec4(t, behind, 0, 0);
}
