#version 460
// Statistics of one chunk of x: least and greatest finite element, mean of the finite ones, counts
// of finite, NaN and infinite ones. NaN and infinity are recognised by their bits, because drivers differ
// in comparing them.
// One workgroup computes one chunk. Bindings: x [elements], partial [chunks] of 2 uvec4:
// the bits of (min, max, mean / 2, 0), and (finite, nan, inf, 0).
#extension GL_GOOGLE_include_directive : require
#include "params/tensor_stats_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { uint x[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Partial { uvec4 partial[]; };
layout(push_constant) uniform Push { TensorStatsParams dims; };

#include "keep_nan.glsl"
#include "reduce.glsl"
#include "workgroup.glsl"

shared vec2 range_scratch[kWorkgroupSize];

void main() {
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint first = group * dims.chunk;
    const bool inside = first < dims.elements;  // the last row of groups may be ragged
    const uint last = inside ? min(first + dims.chunk, dims.elements) : first;
    const uint lane = gl_LocalInvocationID.x;
    const float infinity = uintBitsToFloat(0x7F800000u);

    vec2 range = vec2(infinity, -infinity);
    vec4 counts = vec4(0);  // finite, nan, inf: exact, a chunk has fewer than 2^24 elements
    for (uint i = first + lane; i < last; i += gl_WorkGroupSize.x) {
        const uint magnitude = x[i] & 0x7FFFFFFFu;
        if (magnitude > 0x7F800000u) {
            counts.y += 1;
        } else if (magnitude == 0x7F800000u) {
            counts.z += 1;
        } else {
            counts.x += 1;
            const float value = uintBitsToFloat(x[i]);
            range = vec2(min(range.x, value), max(range.y, value));
        }
    }
    counts = workgroup_sum(counts);

    // Divided first, by twice the count, so that the sum of finite values stays finite when rounded up.
    const float per_count = 0.5 / max(counts.x, 1.0);
    float mean = 0;
    for (uint i = first + lane; i < last; i += gl_WorkGroupSize.x)
        if ((x[i] & 0x7FFFFFFFu) < 0x7F800000u) mean += uintBitsToFloat(x[i]) * per_count;
    mean = workgroup_sum(mean);

    range_scratch[lane] = range;
    for (uint width = gl_WorkGroupSize.x / 2; width > 0; width /= 2) {
        barrier();
        if (lane < width) {
            const vec2 a = range_scratch[lane];
            const vec2 b = range_scratch[lane + width];
            range_scratch[lane] = vec2(min(a.x, b.x), max(a.y, b.y));
        }
    }
    barrier();
    if (lane == 0 && inside) {
        partial[2 * group] = floatBitsToUint(vec4(range_scratch[0], mean, 0));
        partial[2 * group + 1] = uvec4(uvec3(counts.xyz), 0);
    }
}
