#version 460
// Gradients of both losses by the drawn depth D and alpha A. With E = D / A, y = A / D, y0 = max(s p + t, 0),
//   loss of depth = |y - y0| / mean,  d/dD = -sign(y - y0) A / (D^2 mean), d/dA = sign(y - y0) / (D mean)
// and the slopes S of the normals by E, gathered from the four neighbours: d/dD = S / A, d/dA = -S D / A^2.
// One workgroup computes one chunk of pixels and sums the loss of depth.
// Bindings: image [V,H,W] quads, extra [V,H,W] quads, map [H,W] uvec2, slopes [H,W] quads, alignment (s, t, 1 / mean,
// 0); grad_depth [V,H,W], grad_image [V,H,W] quads, whose alpha is added to, partial: the fourth plane.
#extension GL_GOOGLE_include_directive : require
#include "losses/prior_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Image { vec4 image[]; };
layout(set = 0, binding = 1, std430) readonly buffer Extra { vec4 extra[]; };
layout(set = 0, binding = 2, std430) readonly buffer Map { uvec2 map[]; };
layout(set = 0, binding = 3, std430) readonly buffer Slopes { vec4 slopes[]; };
layout(set = 0, binding = 4, std430) readonly buffer Alignment { vec4 alignment[]; };
layout(set = 0, binding = 5, std430) writeonly buffer GradDepth { float grad_depth[]; };
layout(set = 0, binding = 6, std430) buffer GradImage { vec4 grad_image[]; };  // accumulates
layout(set = 0, binding = 7, std430) writeonly buffer Partial { vec4 partial[]; };

#include "reduce.glsl"

// The slope of the normals' loss by E.
float gathered(uint i) {
    const uint x = i % dims.width, y = i / dims.width;
    float sum = 0;
    if (x + 1 < dims.width) sum += slopes[i + 1].x;
    if (x > 0) sum += slopes[i - 1].y;
    if (y + 1 < dims.height) sum += slopes[i + dims.width].z;
    if (y > 0) sum += slopes[i - dims.width].w;
    return dims.normal_scale * sum;
}

// Writes the gradients of a pixel. Returns its loss of depth.
float gradient_at(uint i) {
    const float alpha = image[dims.image + i].a, depth = extra[dims.image + i].x;
    grad_depth[dims.image + i] = 0;
    if (!(alpha > kLeastAlpha)) return 0;
    const float by_e = gathered(i);
    float by_y = 0, loss = 0;
    const float mean = alignment[0].z;
    if (has_depth(map[i]) && mean > 0) {
        const float p = uintBitsToFloat(map[i].x);
        const float d = alpha / depth - max(alignment[0].x * p + alignment[0].y, 0.0);
        loss = abs(d) * mean;
        by_y = dims.depth_scale * sign(d) * mean;
    }
    grad_depth[dims.image + i] = by_e / alpha - by_y * alpha / (depth * depth);
    grad_image[dims.image + i].a += by_y / depth - by_e * depth / (alpha * alpha);
    return loss;
}

void main() {
    const uint pixels = dims.width * dims.height;
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, pixels);
    float sum = 0;
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        sum += gradient_at(i);
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group < dims.chunks) partial[3 * dims.chunks + group] = vec4(sum, 0, 0, 0);
}
