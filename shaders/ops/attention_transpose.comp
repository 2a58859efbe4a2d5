#version 460
// y[n][m] = s[m][n] for each image and head: s as quads [m/4][n], y as quads [n/4][m], zero beyond n.
// One invocation transposes a block of 4 by 4. Bindings: s, y.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, s);
QUADS_OUT(1, y);
layout(push_constant) uniform Push { AttentionParams params; };

void main() {
    const uint block = gl_GlobalInvocationID.x;  // block of rows
    const uint quad = gl_WorkGroupID.y;          // quad of columns
    if (4 * block >= params.m) return;
    const uint image = gl_WorkGroupID.z / params.heads;
    const uint head = gl_WorkGroupID.z % params.heads;
    const uint from = params.s_from + image * params.s_image + head * params.s_head + block * params.s_stride;
    mat4 values;
    [[unroll]] for (uint j = 0; j < 4; ++j) {
        const vec4 value = LD4(s, from + min(4 * quad + j, params.n - 1));
        values[j] = 4 * quad + j < params.n ? value : vec4(0);
    }
    values = transpose(values);
    const uint to = params.y_from + image * params.y_image + head * params.y_head + quad * params.y_stride + 4 * block;
    [[unroll]] for (uint i = 0; i < 4; ++i)
        if (4 * block + i < params.m) ST4(y, to + i, values[i]);
}
