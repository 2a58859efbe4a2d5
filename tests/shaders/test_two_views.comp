#version 450
// y[i] = 2 x[i]; the first half is written in pairs: one array seen as elements of two sizes. One invocation writes one
// element of the second half and perhaps a pair of the first; n is a multiple of 4. For the parser alone.
#extension GL_GOOGLE_include_directive : require
#include "params/spec_ids.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(std430, set = 0, binding = 0) readonly buffer X { float x[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Y { float y[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Pairs { vec2 y_pairs[]; };
layout(push_constant) uniform Params { uint n; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= n / 2) return;
    if (i < n / 4) y_pairs[i] = 2 * vec2(x[2 * i], x[2 * i + 1]);
    y[n / 2 + i] = 2 * x[n / 2 + i];
}
