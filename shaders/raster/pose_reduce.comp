#version 460
// dL/d[R|t] of each view, and of its intrinsics: adds the workgroups' sums of project_backward.comp in a fixed
// order. One workgroup computes one view. Bindings: partial [V][groups][params.quads] vec4; pose [V][3] vec4,
// intrinsics [V] vec4 if params.quads is 4; view_ranges. Specialisation: kRanges: views see ranges.
#extension GL_GOOGLE_include_directive : require
#include "params/raster_reduce_params.h"
#include "raster/view_ranges.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kReduceRangesId) const bool kRanges = false;
layout(set = 0, binding = 0, std430) readonly buffer Partial { vec4 partial[]; };
layout(set = 0, binding = 1, std430) buffer Pose { vec4 pose[]; };  // accumulates
layout(set = 0, binding = 2, std430) buffer Intrinsics { vec4 intrinsics[]; };  // accumulates
UINT_TABLE(3, view_ranges);
layout(push_constant) uniform Push { PoseReduceParams params; };

#include "reduce.glsl"

void main() {
    const uint view = gl_WorkGroupID.x;
    uint begin = view * params.groups, groups = params.groups;
    if (kRanges) {
        begin = RANGE_WORD(view, kRangeGroups);
        groups = (RANGE_WORD(view, kRangeCount) + params.size - 1) / params.size;
    }
    for (uint row = 0; row < params.quads; ++row) {
        vec4 sum = vec4(0);
        for (uint g = gl_LocalInvocationID.x; g < groups; g += gl_WorkGroupSize.x)
            sum += partial[(begin + g) * params.quads + row];
        sum = workgroup_sum(sum);
        if (gl_LocalInvocationID.x == 0 && row == 3) {
            intrinsics[view] = params.accumulate != 0 ? intrinsics[view] + sum : sum;
        } else if (gl_LocalInvocationID.x == 0) {
            const uint at = view * 3 + row;
            pose[at] = params.accumulate != 0 ? pose[at] + sum : sum;
        }
    }
}
