#version 460
// What of a packed set is finite and visible, counted over one chunk: numbers that are NaN or infinite, Gaussians
// with such a number, Gaussians of an opacity below 1/255, and those of them without such a number.
// One workgroup counts one chunk. Bindings: gaussians [N,3] quads, colors [N,color_quads] quads, partial [chunks]
// uvec4.
#extension GL_GOOGLE_include_directive : require
#include "params/tensor_stats_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "load.glsl"
QUADS(0, gaussians);
QUADS(1, colors);
layout(set = 0, binding = 2, std430) writeonly buffer Partial { uvec4 partial[]; };
layout(push_constant) uniform Push { SetStatisticsParams dims; };

#include "finite.glsl"
#include "raster_constants.h"
#include "reduce.glsl"

float not_finite(vec4 v) {
    float count = 0;
    for (uint k = 0; k < 4; ++k) count += finite(v[k]) ? 0.0 : 1.0;
    return count;
}

void main() {
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint first = group * dims.chunk;
    const bool inside = first < dims.gaussians;  // the last row of groups may be ragged
    const uint last = inside ? min(first + dims.chunk, dims.gaussians) : first;
    vec4 counts = vec4(0);  // exact: a chunk has fewer than 2^24 numbers
    for (uint i = first + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x) {
        const vec4 mean = LD4(gaussians, 3 * i);
        float bad = not_finite(mean) + not_finite(LD4(gaussians, 3 * i + 1)) + not_finite(LD4(gaussians, 3 * i + 2));
        for (uint q = 0; q < dims.color_quads; ++q) bad += not_finite(LD4(colors, dims.color_quads * i + q));
        const float faint = finite(mean.w) && mean.w < kAlphaMin ? 1.0 : 0.0;
        counts += vec4(bad, min(bad, 1.0), faint, bad > 0 ? 0.0 : faint);
    }
    counts = workgroup_sum(counts);
    if (gl_LocalInvocationID.x == 0 && inside) partial[group] = uvec4(counts);
}
