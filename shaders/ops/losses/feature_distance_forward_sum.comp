#version 460
// y[n] = the mean of partial over the pixels of image n. One workgroup sums one image.
// Bindings: partial [images, pixels], y (quads of one channel).
#extension GL_GOOGLE_include_directive : require
#include "params/feature_distance_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Partial { float partial[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { FeatureDistanceParams params; };

#include "reduce.glsl"

void main() {
    const uint image = gl_WorkGroupID.y * params.groups_x + gl_WorkGroupID.x;
    const uint pixels = image < params.images ? params.pixels : 0;
    float sum = 0;
    for (uint p = gl_LocalInvocationID.x; p < pixels; p += gl_WorkGroupSize.x)
        sum += partial[image * params.pixels + p];
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && pixels > 0) y[image] = vec4(params.scale * sum, 0, 0, 0);
}
