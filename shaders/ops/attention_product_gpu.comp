#version 460
// Like attention_product.comp, by tiles in shared memory. Workgroups: tiles of columns, of rows, images and heads.
// Bindings: s, v, other, y.
// Specialisation: that of product.glsl, kOther.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kAttentionOtherId) const uint kOther = 0;
layout(set = 0, binding = 0, std430) readonly buffer S { vec4 s[]; };
layout(set = 0, binding = 1, std430) readonly buffer V { vec4 v[]; };
layout(set = 0, binding = 2, std430) readonly buffer Other { vec4 other[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { AttentionParams params; };

#include "channels.glsl"
#include "products/product.glsl"

uint matrix_at(uint from, uint of_image, uint of_head) {
    return from + gl_WorkGroupID.z / params.heads * of_image + gl_WorkGroupID.z % params.heads * of_head;
}

vec4 load_m(uint k, uint m) {
    return s[matrix_at(params.s_from, params.s_image, params.s_head) + k * params.s_stride + min(m, params.m - 1)];
}

vec4 load_n(uint k, uint n) {
    return v[matrix_at(params.v_from, params.v_image, params.v_head) + k * params.v_stride + min(n, params.n - 1)];
}

void store(uint m, uint n, vec4 value) {
    if (4 * m >= params.m || n >= params.n) return;
    const uint to = matrix_at(params.y_from, params.y_image, params.y_head) + m * params.y_stride + n;
    value = params.scale * channels_below(value, 4 * m, params.m);
    if (kOther == kAttentionAddsOther) value += other[to];
    if (kOther == kAttentionTimesOther) value *= other[gl_WorkGroupID.z * params.n + n];
    y[to] = value;
}

void main() {
    product(gl_WorkGroupID.y * kTile, gl_WorkGroupID.x * kTile, 0, (params.k + 3) / 4);
}
