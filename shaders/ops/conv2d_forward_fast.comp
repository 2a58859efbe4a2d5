#version 460
// Like conv2d_forward.comp and conv2d_backward_input.comp, depending on the weight: register tiles of kRows rows of
// pixels by 8 output channels, the lanes along a row; lane l of every 8 also fetches the weights of output channel
// l of the block, which constant shuffles then broadcast.
// One invocation computes kRows pixels, one below the other, of 8 channels. Workgroups: blocks of 8 pixels of a
// row, of kRows rows; blocks of 8 output channels; images.
// Bindings: x quads [C/4][N*H*W], weight from conv2d_pack_weight.comp, bias [K] (read as quads), residual and y
// quads [K/4][N*H*W].
// Specialisation: workgroup size (a multiple of 8).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, weight);
QUADS(2, bias);
QUADS(3, residual);
QUADS_OUT(4, y);
layout(push_constant) uniform Push { Conv2dParams dims; };

const uint kRows = 4;

void main() {
    const uint quads = (dims.in_channels + 3) / 4;
    const uint block = gl_WorkGroupID.y;
    const uint image = gl_WorkGroupID.z;
    const uint lane = gl_SubgroupInvocationID & 7u;
    const uint across = (dims.width + 7) / 8;
    const uint part = (gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x) / 8;
    const int column = int(part % across * 8 + gl_LocalInvocationID.x % 8);
    const int row = int(part / across * kRows);
    const int width = int(dims.width);
    const int height = int(dims.height);

    float sums[8 * kRows];  // [channel][row]
    [[unroll]] for (uint i = 0; i < 8 * kRows; ++i) sums[i] = 0;
    for (uint quad = 0; quad < quads; ++quad) {
        const int base = int(quad * dims.n + image) * height * width;
        [[unroll]] for (uint s = 0; s < 3; ++s) {
            const int near = column + int(s) - 1;
            vec4 v[kRows + 2];
            [[unroll]] for (uint a = 0; a < kRows + 2; ++a) {
                const int at = row + int(a) - 1;
                const ivec2 nearest = clamp(ivec2(at, near), ivec2(0), ivec2(height, width) - 1);
                const vec4 value = LD4(x, base + nearest.x * width + nearest.y);
                v[a] = dims.replicate != 0 || nearest == ivec2(at, near) ? value : vec4(0);
            }
            [[unroll]] for (uint r = 0; r < 3; ++r) {
                const vec4 w = LD4(weight, ((block * quads + quad) * 9 + 3 * r + s) * 8 + lane);
                [[unroll]] for (uint m = 0; m < 8; ++m) {
                    const float w0 = subgroupShuffle(w.x, m);
                    const float w1 = subgroupShuffle(w.y, m);
                    const float w2 = subgroupShuffle(w.z, m);
                    const float w3 = subgroupShuffle(w.w, m);
                    [[unroll]] for (uint a = 0; a < kRows; ++a)
                        sums[m * kRows + a] +=
                            (w0 * v[a + r].x + w1 * v[a + r].y) + (w2 * v[a + r].z + w3 * v[a + r].w);
                }
            }
        }
    }

    if (column >= width) return;
    [[unroll]] for (uint part_of_block = 0; part_of_block < 2; ++part_of_block) {
        const uint quad = 2 * block + part_of_block;
        if (4 * quad >= dims.out_channels) break;
        // Beyond out_channels the weights are zero, but the memory after the bias may hold anything.
        const bvec4 inside = lessThan(4 * quad + uvec4(0, 1, 2, 3), uvec4(dims.out_channels));
        const vec4 shift = dims.has_bias != 0 ? mix(vec4(0), LD4(bias, quad), inside) : vec4(0);
        [[unroll]] for (uint a = 0; a < kRows; ++a) {
            if (row + int(a) >= height) continue;
            const uint s = 4 * part_of_block * kRows + a;
            const uint at = uint((int(quad * dims.n + image) * height + row + int(a)) * width + column);
            vec4 value = vec4(sums[s], sums[s + kRows], sums[s + 2 * kRows], sums[s + 3 * kRows]) + shift;
            if (dims.has_residual != 0) value += LD4(residual, at);
            ST4(y, at, value * dims.scale);
        }
    }
}
