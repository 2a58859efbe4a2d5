#version 460
// Like conv2d_winograd_backward_weight_product_cpu.comp, by tiles in shared memory.
// Workgroups: tiles of input channels, of output channels, places of every part of the sum, which makes a product of
// its own.
// Bindings: input [places][ceil(C/8)][stride] and grad [places][ceil(K/8)][stride], pairs of quads;
// product [slices][places][K][ceil(C/4)] vec4.
// Specialisation: that of product.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/conv2d_winograd_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Transformed { vec4 transformed[]; };
layout(set = 0, binding = 1, std430) readonly buffer Grad { vec4 grad[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Product { vec4 product_out[]; };
layout(push_constant) uniform Push { Conv2dWinogradParams dims; };

#define PRODUCT_OF_ROWS
#include "products/product.glsl"

// Index of a quad of channels of tile k; quads beyond the last repeat it.
uint index_of(uint k, uint quad, uint channels) {
    const uint at = min(quad, (channels - 1) / 4);
    const uint place = gl_WorkGroupID.z % dims.places;
    return ((place * ((channels + 7) / 8) + at / 2) * dims.stride + k) * 2 + at % 2;
}

vec4 load_m(uint k, uint m) { return transformed[index_of(k, m, dims.in_channels)]; }

vec4 load_n(uint k, uint n) { return grad[index_of(k, n, dims.out_channels)]; }

void store(uint m, uint n, vec4 value) {
    const uint in_quads = (dims.in_channels + 3) / 4;
    const uint place = dims.slice * dims.places + gl_WorkGroupID.z;
    if (m < in_quads && n < dims.out_channels) product_out[(place * dims.out_channels + n) * in_quads + m] = value;
}

void main() {
    const uint first = gl_WorkGroupID.z / dims.places * dims.part_tiles;
    const uint last = min(dims.tiles, first + dims.part_tiles);
    product(gl_WorkGroupID.x * kTile, gl_WorkGroupID.y * kTile, min(first, last), last);
}
