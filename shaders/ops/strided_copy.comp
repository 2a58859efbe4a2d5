#version 460
// y[i * out_stride + out_offset + c] = x[i * in_stride + in_offset + c] for c < channels; or += where
// params.accumulate is set.
// One invocation copies one float. Bindings: x, y, both arrays of float.
#extension GL_GOOGLE_include_directive : require
#include "params/strided_copy_params.h"

layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) buffer Y { float y[]; };  // accumulates
layout(push_constant) uniform Push { StridedCopyParams params; };

#include "launch.glsl"

void main() {
    const uint index = invocation_index(params.groups_x);
    if (index >= params.count * params.channels) return;
    const uint i = index / params.channels;
    const uint c = index - i * params.channels;
    const uint to = i * params.out_stride + params.out_offset + c;
    const float value = x[i * params.in_stride + params.in_offset + c];
    if (params.accumulate != 0)
        y[to] += value;
    else
        y[to] = value;
}
