#version 460
// partial[s][o][k] = sum of grad_y[r][o] * x[r][k] over the rows r of slice s.
// Rows are summed in blocks of 64, then the blocks: over 10^5 rows one running sum would cost two
// digits. linear_backward_weight_reduce.comp sums the slices.
// One invocation computes one weight of one slice.
// Bindings: x, grad_y, partial [slices][out][ceil(in/4) * 4]; x and grad_y as quads [features/4][rows].
#extension GL_GOOGLE_include_directive : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Partial { float partial[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#include "launch.glsl"
#include "linear_slices.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= dims.out_features * dims.in_features) return;
    const uint o = i / dims.in_features;
    const uint k = i % dims.in_features;
    const uint end = slice_end(gl_WorkGroupID.z);
    float total = 0;
    for (uint first = slice_begin(gl_WorkGroupID.z); first < end; first += kBlock) {
        float sum = 0;
        for (uint r = first; r < min(first + kBlock, end); ++r)
            sum += grad_y[((o / 4) * dims.rows + r) * 4 + o % 4] *
                   x[((k / 4) * dims.rows + r) * 4 + k % 4];
        total += sum;
    }
    const uint padded = (dims.in_features + 3) / 4 * 4;
    partial[(gl_WorkGroupID.z * dims.out_features + o) * padded + k] = total;
}
