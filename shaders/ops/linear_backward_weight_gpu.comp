#version 460
// partial[s][o][k] = sum over the rows of slice s of grad_y[r][o] * x[r][k], by tiles in shared memory.
// Workgroups: tiles of input features, of output features, slices.
// Bindings: x quads [in/4][rows], grad_y quads [out/4][rows], partial [slices][out][ceil(in/4)] vec4.
// Specialisation: that of product.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { vec4 x[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { vec4 grad_y[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Partial { vec4 partial[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#define PRODUCT_OF_ROWS
#include "linear_slices.glsl"
#include "products/product.glsl"

vec4 load_m(uint k, uint m) { return x[min(m, (dims.in_features - 1) / 4) * dims.rows + k]; }

vec4 load_n(uint k, uint n) { return grad_y[min(n, (dims.out_features - 1) / 4) * dims.rows + k]; }

void store(uint m, uint n, vec4 value) {
    const uint in_quads = (dims.in_features + 3) / 4;
    if (m < in_quads && n < dims.out_features)
        partial[(gl_WorkGroupID.z * dims.out_features + n) * in_quads + m] = value;
}

void main() {
    const uint end = slice_end(gl_WorkGroupID.z);
    product(gl_WorkGroupID.x * kTile, gl_WorkGroupID.y * kTile, min(slice_begin(gl_WorkGroupID.z), end), end);
}
