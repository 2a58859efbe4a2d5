#version 460
// The window along columns completes the slopes D of SSIM; with m the mask and d = a - t,
//   grad_a = m (l1_scale sign(d) - ssim_scale (D_means + 2 p D_pp + 2 q D_qq)),  0 for alpha
// Through an exposure a is gains * image + offsets, and the image gets transpose(gains) * grad_a.
// One workgroup computes one chunk of pixels and sums |d| and d^2.
// Bindings: image [V,H,W] quads, truth [H,W] uint, rows (three planes of quads), grad_image [V,H,W] quads, partial:
// quads (sum |d|, sum 1 - SSIM, sum d^2, 0), of which this kernel writes the first and the third; and those of the
// exposure's gradient, a quad for each of its rows.
#extension GL_GOOGLE_include_directive : require
#include "losses/photo_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Image { vec4 image[]; };
layout(set = 0, binding = 1, std430) readonly buffer Truth { uint truth[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rows { vec4 rows[]; };
layout(set = 0, binding = 3, std430) writeonly buffer GradImage { vec4 grad_image[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Partial { vec4 partial[]; };

#include "reduce.glsl"

vec4 by_exposure[3] = vec4[3](vec4(0), vec4(0), vec4(0));

// (sum |d|, 0, sum d^2, 0) of a pixel.
vec4 gradient_at(uint i, uint pixels) {
    const int y = int(i / dims.width);
    vec4 d[3] = vec4[3](vec4(0), vec4(0), vec4(0));
    for (int tap = 0; tap < kTaps; ++tap) {
        const int to = y + tap - kTaps / 2;
        if (to < 0 || to >= int(dims.height)) continue;
        for (uint k = 0; k < 3; ++k) d[k] += kWindow[tap] * rows[k * pixels + uint(to) * dims.width + i % dims.width];
    }
    grad_image[dims.image + i] = vec4(0);
    if (!counts(truth[i])) return vec4(0);
    const vec3 color = image[dims.image + i].rgb, a = exposed(color), t = color_of(truth[i]).rgb, q = a - t;
    const vec3 by_ssim = d[0].rgb + 2 * ((a + t - kPivot) * d[1].rgb + q * d[2].rgb);
    const vec3 gradient = dims.l1_scale * sign(q) - dims.ssim_scale * by_ssim;
    grad_image[dims.image + i] = vec4(kExposure == 0 ? gradient : gradient * gains(), 0);
    for (uint k = 0; k < 3; ++k) by_exposure[k] += gradient[k] * vec4(color, 1);
    return vec4(abs(q.r) + abs(q.g) + abs(q.b), 0, dot(q, q), 0);
}

void main() {
    const uint pixels = dims.width * dims.height;
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, pixels);
    vec4 sum = vec4(0);
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        sum += gradient_at(i, pixels);
    sum = workgroup_sum(sum);
    const bool writes = gl_LocalInvocationID.x == 0 && group * dims.chunk < pixels;
    if (writes) partial[dims.first + group] = sum;
    if (kExposure == 0) return;
    for (uint k = 0; k < 3; ++k) {
        const vec4 row = workgroup_sum(by_exposure[k]);
        if (writes) partial[dims.exposures + 3 * group + k] = row;
    }
}
