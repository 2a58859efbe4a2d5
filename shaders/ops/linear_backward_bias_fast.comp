#version 460
// Like linear_backward_bias.comp, with fast loads. One workgroup computes one quad of outputs.
// Bindings: grad_y as quads [out/4][rows], grad_bias [out].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
layout(set = 0, binding = 1, std430) buffer GradBias { float grad_bias[]; };  // accumulates
layout(push_constant) uniform Push { LinearParams dims; };

#include "reduce.glsl"

const uint kUnroll = 4;

void main() {
    const uint quad = gl_WorkGroupID.x;
    const uint lane = gl_LocalInvocationID.x;
    const uint step = gl_WorkGroupSize.x;
    const uint whole = dims.rows / (kUnroll * step) * (kUnroll * step);
    const uint at = quad * dims.rows + lane;
    vec4 sum = vec4(0);
    for (uint r = 0; r < whole; r += kUnroll * step)
        sum += (LD4(grad_y, at + r) + LD4(grad_y, at + r + step)) +
               (LD4(grad_y, at + r + 2 * step) + LD4(grad_y, at + r + 3 * step));
    for (uint r = whole; r + lane < dims.rows; r += step) sum += LD4(grad_y, at + r);
    sum = workgroup_sum(sum) * dims.scale;
    const uint o = 4 * quad + lane;
    if (lane < 4 && o < dims.out_features) grad_bias[o] = dims.accumulate != 0 ? grad_bias[o] + sum[lane] : sum[lane];
}
