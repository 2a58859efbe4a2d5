#version 460
// Sums that align a map p of depth with what is drawn, over pixels that have both: with y = alpha / depth,
//   sum (1, p, p^2, 0), sum (y, p y, 0, 0)
// One workgroup computes one chunk of pixels.
// Bindings: image [V,H,W] quads, extra [V,H,W] quads, map [H,W] uvec2, partial: two planes of a quad for each chunk.
#extension GL_GOOGLE_include_directive : require
#include "losses/prior_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Image { vec4 image[]; };
layout(set = 0, binding = 1, std430) readonly buffer Extra { vec4 extra[]; };
layout(set = 0, binding = 2, std430) readonly buffer Map { uvec2 map[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Partial { vec4 partial[]; };

#include "reduce.glsl"

void main() {
    const uint pixels = dims.width * dims.height;
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, pixels);
    vec4 maps = vec4(0), products = vec4(0);
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x) {
        const float alpha = image[dims.image + i].a, depth = extra[dims.image + i].x;
        if (!has_depth(map[i]) || !(alpha > kLeastAlpha)) continue;
        const float p = uintBitsToFloat(map[i].x), y = alpha / depth;
        maps += vec4(1, p, p * p, 0);
        products += vec4(y, p * y, 0, 0);
    }
    maps = workgroup_sum(maps);
    products = workgroup_sum(products);
    if (gl_LocalInvocationID.x != 0 || group >= dims.chunks) return;
    partial[group] = maps;
    partial[dims.chunks + group] = products;
}
