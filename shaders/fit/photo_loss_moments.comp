#version 460
// The window along columns over p, p^2, q and q^2 (similarity.glsl) of image and truth, which are zero outside the
// mask. One invocation computes one pixel.
// Bindings: image [V,H,W] quads, truth [H,W] uint, moments: four planes of quads.
#extension GL_GOOGLE_include_directive : require
#include "losses/photo_loss.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Image { vec4 image[]; };
layout(set = 0, binding = 1, std430) readonly buffer Truth { uint truth[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Moments { vec4 moments[]; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(dims.groups_x);
    const uint pixels = dims.width * dims.height;
    if (i >= pixels) return;
    const int y = int(i / dims.width);
    vec4 sums[4] = vec4[4](vec4(0), vec4(0), vec4(0), vec4(0));
    for (int tap = 0; tap < kTaps; ++tap) {
        const int to = y + tap - kTaps / 2;
        vec4 p = vec4(-kPivot), q = vec4(0);
        if (to >= 0 && to < int(dims.height)) {
            const uint at = uint(to) * dims.width + i % dims.width;
            if (counts(truth[at])) {
                const vec4 a = vec4(exposed(image[dims.image + at].rgb), 0), t = color_of(truth[at]);
                p = a + t - kPivot;
                q = a - t;
            }
        }
        sums[0] += kWindow[tap] * p;
        sums[1] += kWindow[tap] * (p * p);
        sums[2] += kWindow[tap] * q;
        sums[3] += kWindow[tap] * (q * q);
    }
    for (uint k = 0; k < 4; ++k) moments[k * pixels + i] = sums[k];
}
