#version 460
// Least squares of s p + t to the drawn inverse depth y from the sums of prior_loss_sums, or what is known before:
//   s = (n sum p y - sum p sum y) / (n sum p^2 - (sum p)^2),  t = (sum y - s sum p) / n
// One workgroup computes all of it. Where s is not positive, the view has no loss: its inverse mean is 0.
// Bindings: partial: two planes of quads, alignment: (s, t, 1 / mean of y, 0).
#extension GL_GOOGLE_include_directive : require
#include "losses/prior_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Partial { vec4 partial[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Alignment { vec4 alignment[]; };

#include "reduce.glsl"

vec4 least_squares(vec4 maps, vec4 products) {
    const float n = maps.x, below = n * maps.z - maps.y * maps.y;
    const float above = n * products.y - maps.y * products.x;
    if (!(below > 1e-6 * n * n && above > 0 && products.x > 0)) return vec4(0);
    const float s = above / below;
    return vec4(s, (products.x - s * maps.y) / n, n / products.x, 0);
}

void main() {
    vec4 maps = vec4(0), products = vec4(0);
    const uint chunks = dims.aligned != 0u ? 0u : dims.chunks;
    for (uint i = gl_LocalInvocationID.x; i < chunks; i += gl_WorkGroupSize.x) {
        maps += partial[i];
        products += partial[dims.chunks + i];
    }
    maps = workgroup_sum(maps);
    products = workgroup_sum(products);
    if (gl_LocalInvocationID.x != 0 || gl_WorkGroupID.x + gl_WorkGroupID.y != 0) return;
    alignment[0] = dims.aligned != 0u ? vec4(dims.scale, dims.shift, dims.inverse_mean, 0)
                                      : least_squares(maps, products);
}
