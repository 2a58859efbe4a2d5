#version 460
// Sums each Gaussian's records of weights and pixels over all views, in their fixed order. One invocation
// computes one Gaussian; with kRanges, of a range, over the views that see this range.
// Bindings: counts [V*N] and, from params.begins, first records; records of blend_backward as vec2; contributions
// [N] vec2 (sum of the weights, number of pixels that see it); view_ranges.
// Specialisation: kRanges: views see ranges.
#extension GL_GOOGLE_include_directive : require
#include "params/raster_reduce_params.h"
#include "raster/view_ranges.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kReduceRangesId) const bool kRanges = false;
layout(set = 0, binding = 0, std430) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, std430) readonly buffer Records { vec2 records[]; };
layout(set = 0, binding = 2, std430) buffer Contributions { vec2 contributions[]; };  // accumulates
UINT_TABLE(3, view_ranges);
layout(push_constant) uniform Push { ContributionReduceParams params; };

#include "launch.glsl"

void main() {
    uint index = invocation_index(params.groups_x), number = index, view = 0, seen = params.gaussians;
    if (kRanges) {
        const uint at = gl_WorkGroupID.y * params.groups_x + gl_WorkGroupID.x;
        VIEW_AT(at, kRangeGroups, params.views, view)
        if (RANGE_WORD(view, kRangeLayer) != params.layer) return;
        number = index - RANGE_WORD(view, kRangeGroups) * gl_WorkGroupSize.x;
        index = RANGE_WORD(view, kRangeFirst) + number;
        seen = RANGE_WORD(view, kRangeCount);
    }
    if (number >= seen) return;
    const bool apart = kRanges && params.layer > 0;
    const vec2 before = apart || params.accumulate != 0 ? contributions[index] : vec2(0);
    vec2 sum = apart ? vec2(0) : before;
    while (view < params.views) {
        const uint item = (kRanges ? RANGE_WORD(view, kRangeItems) : view * params.gaussians) + number;
        const uint begin = counts[params.begins + item], end = begin + counts[item];
        for (uint i = begin; i < end; ++i) sum += records[i * params.stride + params.first];
        view = kRanges ? RANGE_WORD(view, kRangeNext) : view + 1;
    }
    contributions[index] = apart ? before + sum : sum;
}
