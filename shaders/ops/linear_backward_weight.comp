#version 460
// grad_weight[o][k] = sum_r grad_y[r][o] * x[r][k], added to what is there when accumulate is set.
// Rows are summed in blocks of 64, then the blocks: rows run to 10^5, where one running sum would
// cost two digits.
// One invocation computes one weight. Bindings: x, grad_y, grad_weight [out,in] row-major; x and
// grad_y as quads [features/4][rows].
#extension GL_GOOGLE_include_directive : require
#include "params/linear_params.h"

layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 2, std430) buffer GradWeight { float grad_weight[]; };  // accumulates
layout(push_constant) uniform Push { LinearParams dims; };

const uint kBlock = 64;

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.out_features * dims.in_features) return;
    const uint o = i / dims.in_features;
    const uint k = i % dims.in_features;
    float total = 0;
    for (uint first = 0; first < dims.rows; first += kBlock) {
        float sum = 0;
        for (uint r = first; r < min(first + kBlock, dims.rows); ++r)
            sum += grad_y[((o / 4) * dims.rows + r) * 4 + o % 4] * x[((k / 4) * dims.rows + r) * 4 + k % 4];
        total += sum;
    }
    grad_weight[i] = dims.accumulate != 0 ? grad_weight[i] + total : total;
}
