// The item that an invocation of a kernel of the projection computes.

#ifndef SPLAT_PROJECT_ITEMS_GLSL
#define SPLAT_PROJECT_ITEMS_GLSL

#include "launch.glsl"
#include "raster/view_ranges.glsl"

// The Gaussian by its place in this dispatch's part of the set, the view (gl_WorkGroupID.z unless kFlagRanges), and the
// item. Returns false for an invocation without one. Needs kFlags, `params` and UINT_TABLE view_ranges.
bool item_of_invocation(out uint index, out uint view, out uint item) {
    index = invocation_index(params.groups_x);
    view = gl_WorkGroupID.z;
    item = view * params.gaussians + params.first + index;
    if ((kFlags & kFlagRanges) == 0) return index < params.count;
    const uint group = gl_WorkGroupID.y * params.groups_x + gl_WorkGroupID.x;
    VIEW_AT(group, kRangeGroups, params.views, view)
    const uint before = (group - RANGE_WORD(view, kRangeGroups)) * gl_WorkGroupSize.x;
    const uint number = before + gl_LocalInvocationID.x;
    const uint begin = RANGE_WORD(view, kRangeFirst) + before - params.first;  // huge if it lies before this part
    index = begin + gl_LocalInvocationID.x;
    item = RANGE_WORD(view, kRangeItems) + number;
    return begin < params.count && number < RANGE_WORD(view, kRangeCount);
}

#endif
