#version 460
// spread[r][k][p] = scale * grad_y[k][p - (r/3-1, r%3-1)] of the nine taps r, zero outside the image: a factor of
// the matrix products that give the gradients of the input and the weight.
// One invocation computes one quad of spread. Workgroups: see launch.glsl.
// Bindings: grad_y quads [K/4][N*H*W], spread quads [9][K/4][N*H*W].
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
QUADS_OUT(1, spread);
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint pixels = dims.n * dims.height * dims.width;
    const uint quads = (dims.out_channels + 3) / 4;
    const uint i = invocation_index(dims.groups_x);
    if (i >= 9 * quads * pixels) return;
    const uint tap = i / pixels / quads;
    const uint pixel = i % pixels;
    const int down = 1 - int(tap / 3);
    const int right = 1 - int(tap % 3);
    const uint near_row = uint(int(pixel / dims.width % dims.height) + down);
    const uint near_column = uint(int(pixel % dims.width) + right);
    const bool valid = near_row < dims.height && near_column < dims.width;
    const int at = int(i - tap * quads * pixels) + down * int(dims.width) + right;
    const vec4 value = LD4(grad_y, valid ? at : 0);
    ST4(spread, i, valid ? dims.scale * value : vec4(0));
}
