#version 460
// The window along rows completes the moments; from them 1 - SSIM, and the slopes of SSIM with respect to the means,
// E[p^2] and E[q^2] (similarity.glsl), both zero outside the mask. One workgroup sums one chunk of 1 - SSIM.
// Bindings: moments (four planes of quads), truth [H,W] uint, slopes (three planes of quads), partial: quads
// (sum |a - t|, sum 1 - SSIM, sum (a - t)^2, 0), of which this kernel writes the second.
#extension GL_GOOGLE_include_directive : require
#include "losses/photo_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Moments { vec4 moments[]; };
layout(set = 0, binding = 1, std430) readonly buffer Truth { uint truth[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Slopes { vec4 slopes[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Partial { vec4 partial[]; };

#include "reduce.glsl"

float unlike_at(uint i, uint pixels) {
    const int x = int(i % dims.width);
    vec4 m[4] = vec4[4](vec4(0), vec4(0), vec4(0), vec4(0));
    for (int tap = 0; tap < kTaps; ++tap) {
        const int to = x + tap - kTaps / 2;
        const bool inside = to >= 0 && to < int(dims.width);
        const uint at = inside ? uint(int(i) + to - x) : i;
        for (uint k = 0; k < 4; ++k) m[k] += kWindow[tap] * (inside ? moments[k * pixels + at] : kOutside[k]);
    }
    const Similarity found = similarity(m);
    const bool counted = counts(truth[i]);
    for (uint k = 0; k < 3; ++k) slopes[k * pixels + i] = counted ? found.slopes[k] : vec4(0);
    return counted ? found.unlike.x + found.unlike.y + found.unlike.z : 0.0;
}

void main() {
    const uint pixels = dims.width * dims.height;
    const uint group = gl_WorkGroupID.y * dims.groups_x + gl_WorkGroupID.x;
    const uint last = min((group + 1) * dims.chunk, pixels);
    float sum = 0;
    for (uint i = group * dims.chunk + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x)
        sum += unlike_at(i, pixels);
    sum = workgroup_sum(sum);
    if (gl_LocalInvocationID.x == 0 && group * dims.chunk < pixels) partial[dims.first + group] = vec4(0, sum, 0, 0);
}
