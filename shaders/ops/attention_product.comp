#version 460
// y[m][n] = scale * sum_k s[k][m] v[k][n] for each image and head, all three as quads over their first
// index: s [k/4][m], v [k/4][n], y [m/4][n].
// One invocation computes one quad of y. Bindings: s, v, other, y.
// Specialisation: kOther (params/attention_params.h).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kAttentionOtherId) const uint kOther = 0;
layout(set = 0, binding = 0, std430) readonly buffer S { vec4 s[]; };
layout(set = 0, binding = 1, std430) readonly buffer V { vec4 v[]; };
layout(set = 0, binding = 2, std430) readonly buffer Other { vec4 other[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { AttentionParams params; };

void main() {
    const uint column = gl_GlobalInvocationID.x;
    if (column >= params.n) return;
    const uint quad = gl_WorkGroupID.y;
    const uint image = gl_WorkGroupID.z / params.heads;
    const uint head = gl_WorkGroupID.z % params.heads;
    const uint from_s = params.s_from + image * params.s_image + head * params.s_head;
    const uint from_v = params.v_from + image * params.v_image + head * params.v_head + column;
    const uint rows = min(4, params.m - 4 * quad);
    vec4 value = vec4(0);
    for (uint q = 0; q < (params.k + 3) / 4; ++q)
        [[unroll]] for (uint lane = 0; lane < 4; ++lane)
            if (lane < rows)
                value[lane] += dot(s[from_s + q * params.s_stride + 4 * quad + lane], v[from_v + q * params.v_stride]);
    const uint to = params.y_from + image * params.y_image + head * params.y_head + quad * params.y_stride + column;
    value *= params.scale;
    if (kOther == kAttentionAddsOther) value += other[to];
    if (kOther == kAttentionTimesOther) value *= other[gl_WorkGroupID.z * params.n + column];
    y[to] = value;
}
