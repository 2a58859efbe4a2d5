#version 460
// grad_weight[k][c] = scale * G^T (sum_s product[s][k][c]) G, added to the existing values when kAccumulate is set.
// One invocation computes the taps of one output channel and four input channels.
// Bindings: product [slices][kSize^2][K][ceil(C/4)] vec4, grad_weight [K,C,3,3] row-major.
// Specialisation: workgroup size, kTile, kAccumulate, kWhole: C is a multiple of 4 and the 36 taps
// are nine quads (not push constants: lavapipe executes both branches).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "params/conv2d_winograd_params.h"
#include "winograd.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kWinogradAccumulateId) const uint kAccumulate = 0;
layout(constant_id = kWinogradWholeId) const uint kWhole = 1;
QUADS(0, product);
layout(set = 0, binding = 1, std430) buffer GradWeight { vec4 grad_weight[]; };  // accumulates
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#include "launch.glsl"

void main() {
    const uint quads = (dims.in_channels + 3) / 4;
    const uint places = kSize * kSize;
    const uint of_place = dims.out_channels * quads;
    const uint i = invocation_index(dims.groups_x);
    if (i >= of_place) return;
    const uint k = i / quads;
    const uint quad = i % quads;

    vec4 values[kRow * kRow];
    [[unroll]] for (uint j = 0; j < kSize; ++j)
        [[unroll]] for (uint l = 0; l < kSize; ++l)
            values[j * kRow + l] = LD4(product, (j * kSize + l) * of_place + i);
    for (uint s = 1; s < dims.slices; ++s)
        [[unroll]] for (uint j = 0; j < kSize; ++j)
            [[unroll]] for (uint l = 0; l < kSize; ++l)
                values[j * kRow + l] += LD4(product, (s * places + j * kSize + l) * of_place + i);
    [[unroll]] for (uint l = 0; l < kSize; ++l) apply_gt(COLUMN_OF(values, l));
    [[unroll]] for (uint r = 0; r < 3; ++r) apply_gt(ROW_OF(values, r));
    if (kWhole != 0) {
        [[unroll]] for (uint q = 0; q < 9; ++q) {
            vec4 taps;
            [[unroll]] for (uint e = 0; e < 4; ++e) {
                const uint n = 4 * q + e;
                taps[e] = dims.scale * values[n % 9 / 3 * kRow + n % 3][n / 9];
            }
            grad_weight[9 * i + q] = kAccumulate != 0 ? grad_weight[9 * i + q] + taps : taps;
        }
        return;
    }
    [[unroll]] for (uint n = 0; n < 36; ++n) {
        if (4 * quad + n / 9 >= dims.in_channels) continue;
        const uint at = (k * dims.in_channels + 4 * quad) * 9 + n;
        const float value = dims.scale * values[n % 9 / 3 * kRow + n % 3][n / 9];
        grad_weight[at / 4][at % 4] = kAccumulate != 0 ? grad_weight[at / 4][at % 4] + value : value;
    }
}
