#version 460
// grad_residual = scale * grad_y. One invocation computes one quad.
// Bindings: grad_y, grad_residual; both as quads [channels/4][N*H*W].
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/conv2d_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, grad_y);
QUADS_OUT(1, grad_residual);
layout(push_constant) uniform Push { Conv2dParams dims; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    if (i >= (dims.out_channels + 3) / 4 * dims.n * dims.height * dims.width) return;
    ST4(grad_residual, i, dims.scale * LD4(grad_y, i));
}
