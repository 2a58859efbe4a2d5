#version 460
// loss = scale * the sum of partial. One workgroup sums all. Bindings: partial [sums], loss [1].
#extension GL_GOOGLE_include_directive : require
#include "params/loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Partial { float partial[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Loss { float loss[]; };
layout(push_constant) uniform Push { LossParams params; };

#include "reduce.glsl"

void main() {
    float sum = 0;
    for (uint i = gl_LocalInvocationID.x; i < params.sums; i += gl_WorkGroupSize.x) sum += partial[i];
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0) loss[0] = params.scale * sum;
}
