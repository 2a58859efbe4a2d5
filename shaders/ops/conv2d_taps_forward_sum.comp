#version 460
// y[k][p] = (sum_r products[r][k][p + (r/3-1, r%3-1)] + bias[k] + residual[k][p]) * scale over the taps r that lie
// in the image: the end of a convolution by taps.
// One invocation computes one quad of y. Workgroups: see launch.glsl.
// Bindings: products quads [9][K/4][N*H*W], bias [K] (read as quads), residual and y quads [K/4][N*H*W].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, products);
QUADS(1, bias);
QUADS(2, residual);
QUADS_OUT(3, y);
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint pixels = dims.n * dims.height * dims.width;
    const uint quads = (dims.out_channels + 3) / 4;
    const uint i = invocation_index(dims.groups_x);
    if (i >= quads * pixels) return;
    const uint pixel = i % pixels;
    const int row = int(pixel / dims.width % dims.height);
    const int column = int(pixel % dims.width);
    vec4 value = vec4(0);
    [[unroll]] for (uint tap = 0; tap < 9; ++tap) {
        const int down = int(tap / 3) - 1;
        const int right = int(tap % 3) - 1;
        const bool valid = uint(row + down) < dims.height && uint(column + right) < dims.width;
        const int at = int(tap * quads * pixels + i) + down * int(dims.width) + right;
        const vec4 product = LD4(products, valid ? at : 0);
        value += valid ? product : vec4(0);
    }
    const uint quad = i / pixels;
    if (dims.has_bias != 0) {  // the memory after the bias may hold anything
        const bvec4 inside = lessThan(4 * quad + uvec4(0, 1, 2, 3), uvec4(dims.out_channels));
        value += mix(vec4(0), LD4(bias, quad), inside);
    }
    if (dims.has_residual != 0) value += LD4(residual, i);
    ST4(y, i, value * dims.scale);
}
