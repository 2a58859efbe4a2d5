#version 460
// y = (x W^T + bias + residual) * scale by tiles in shared memory. Workgroups: tiles of output features (next to each
// other in time, so that the rows stay in the cache), of rows (y, z).
// Bindings: x quads [in/4][rows], weight from linear_pack_weight.comp, bias [out] (read as quads),
// residual and y quads [out/4][rows].
// Specialisation: that of product.glsl, kResidual: there is a residual.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/linear_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kLinearResidualId) const uint kResidual = 1;
layout(set = 0, binding = 0, std430) readonly buffer X { vec4 x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Weight { vec4 weight[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bias { vec4 bias[]; };
layout(set = 0, binding = 3, std430) readonly buffer Residual { vec4 residual[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { LinearParams dims; };

#include "products/product.glsl"

vec4 load_m(uint k, uint m) {
    const uint padded_quads = (dims.in_features + 7) / 8 * 2;
    return weight[(min(m / 8, (dims.out_features - 1) / 8) * padded_quads + k) * 8 + m % 8];
}

vec4 load_n(uint k, uint n) { return x[k * dims.rows + min(n, dims.rows - 1)]; }

void store(uint m, uint n, vec4 value) {
    if (4 * m >= dims.out_features || n >= dims.rows) return;
    // Beyond out_features the weights are zero, but the memory after the bias may hold anything.
    const bvec4 inside = lessThan(4 * m + uvec4(0, 1, 2, 3), uvec4(dims.out_features));
    if (dims.has_bias != 0) value += mix(vec4(0), bias[m], inside);
    if (kResidual != 0) value += residual[m * dims.rows + n];
    y[m * dims.rows + n] = value * dims.scale;
}

void main() {
    const uint row_tile = gl_WorkGroupID.z * dims.groups_x + gl_WorkGroupID.y;
    product(gl_WorkGroupID.x * kTile, row_tile * kTile, 0, (dims.in_features + 3) / 4);
}
