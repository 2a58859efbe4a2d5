#version 460
// Like conv2d_winograd_forward_product_cpu.comp, by tiles in shared memory. Workgroups: tiles of output channels, of
// Winograd's tiles, places.
// Bindings: transformed [places][ceil(C/8)][stride] pairs of quads, weight from
// conv2d_winograd_forward_weight.comp, product [places][ceil(K/8)][stride] pairs of quads.
// Specialisation: that of product.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/conv2d_winograd_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Transformed { vec4 transformed[]; };
layout(set = 0, binding = 1, std430) readonly buffer Weight { vec4 weight[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Product { vec4 product_out[]; };
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#include "products/product.glsl"

// Index of the octet with a channel, in all places.
uint octet_of(uint channel, uint channels) {
    return gl_WorkGroupID.z * ((channels + 7) / 8) + min(channel, channels - 1) / 8;
}

vec4 load_m(uint k, uint m) {
    const uint quads = (dims.in_channels + 7) / 8 * 2;
    return weight[(octet_of(m, dims.out_channels) * quads + k) * 8 + m % 8];
}

vec4 load_n(uint k, uint n) {
    return transformed[(octet_of(4 * k, dims.in_channels) * dims.stride + min(n, dims.tiles - 1)) * 2 + k % 2];
}

void store(uint m, uint n, vec4 value) {
    if (4 * m < dims.out_channels && n < dims.tiles)
        product_out[(octet_of(4 * m, dims.out_channels) * dims.stride + n) * 2 + m % 2] = value;
}

void main() { product(gl_WorkGroupID.x * kTile, gl_WorkGroupID.y * kTile, 0, (dims.in_channels + 3) / 4); }
