#version 460
// Weights in the order in which linear_forward_cpu.comp and linear_forward_gpu.comp read them:
//   packed[b][q][m] = (w[8b+m][4q], ..., w[8b+m][4q+3]),  w = weight or, when transposed, its
//   transpose; zero beyond the edges.
// Quads come in pairs, because linear_forward_cpu.comp may take two of them at once.
// in_features and out_features are those of w. One invocation writes one quad.
// Bindings: weight row-major, packed [ceil(out/8)][2*ceil(in/8)][8] vec4.
#extension GL_GOOGLE_include_directive : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Weight { float weight[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Packed { vec4 packed[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#include "launch.glsl"

void main() {
    const uint quads = (dims.in_features + 7) / 8 * 2;
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.out_features + 7) / 8 * quads * 8) return;
    const uint o = i / (8 * quads) * 8 + i % 8;
    const uint q = i / 8 % quads;
    vec4 value = vec4(0);
    if (o < dims.out_features)
        for (uint lane = 0; lane < 4 && 4 * q + lane < dims.in_features; ++lane) {
            const uint k = 4 * q + lane;
            value[lane] = dims.transposed != 0 ? weight[k * dims.out_features + o] : weight[o * dims.in_features + k];
        }
    packed[i] = value;
}
