#version 460
// grad_bias[o] = scale * sum_r grad_y[r][o], added to the existing values when accumulate is set.
// One workgroup computes one quad of outputs. Bindings: grad_y as quads [out/4][rows], grad_bias
// [out].
#extension GL_GOOGLE_include_directive : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer GradY { vec4 grad_y[]; };
layout(set = 0, binding = 1, std430) buffer GradBias { float grad_bias[]; };  // accumulates
layout(push_constant) uniform Push { LinearParams dims; };

#include "reduce.glsl"

void main() {
    const uint quad = gl_WorkGroupID.x;
    const uint lane = gl_LocalInvocationID.x;
    vec4 sum = vec4(0);
    for (uint r = lane; r < dims.rows; r += gl_WorkGroupSize.x) sum += grad_y[quad * dims.rows + r];
    sum = workgroup_sum(sum) * dims.scale;
    const uint o = 4 * quad + lane;
    if (lane < 4 && o < dims.out_features) grad_bias[o] = dims.accumulate != 0 ? grad_bias[o] + sum[lane] : sum[lane];
}
