#version 460
// How far the Gaussians i of a plane p lie off it, and how thick they are across it:
//   offset_p = mean of n_p . mean_i     partial_p = sum of (n_p . mean_i - offset_p)^2 + |scale_i * (n_p^T R_i)|^2
// One workgroup computes one plane. Bindings: plane_loss.glsl's; offsets [planes], partial [planes].
#extension GL_GOOGLE_include_directive : require
#include "params/loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "plane_loss.glsl"
layout(set = 0, binding = 4, std430) writeonly buffer Offsets { float offsets[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Partial { float partial[]; };

#include "reduce.glsl"

void main() {
    const uint plane = plane_of_group();
    const bool inside = plane < params.planes;  // the last row of groups may be ragged
    const uint first = inside ? LD1(begins, plane) : 0, last = inside ? LD1(begins, plane + 1) : 0;
    const vec3 normal = inside ? LD4(normals, plane).xyz : vec3(0);
    float offset = 0;
    for (uint i = first + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        offset += dot(normal, LD4(gaussians, 3 * LD1(members, i)).xyz);
    offset = workgroup_sum(offset) / max(float(last - first), 1.0);
    float sum = 0;
    for (uint i = first + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x) {
        const Member m = member_at(i, normal);
        const float off = dot(normal, m.mean) - offset;
        const vec3 thick = m.scale * m.across;
        sum += off * off + dot(thick, thick);
    }
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x != 0 || !inside) return;
    offsets[plane] = offset;
    partial[plane] = sum;
}
