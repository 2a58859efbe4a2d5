#version 460
// Like photo_loss_gradient.comp, for devices whose shaders run on a CPU: 8 lanes take 8 columns and kRows rows each.
// Bindings: image [V,H,W] quads, truth [H,W] uint, rows and rest (photo_loss_slopes_cpu.comp), grad_image [V,H,W]
// quads, partial: a quad (sum |d|, 0, sum d^2, 0) per lane, and three of the exposure's gradient.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "losses/photo_loss.glsl"
#include "store.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, image);
UINTS(1, truth);
QUADS(2, rows);
UINTS(3, rest);
QUADS_OUT(4, grad_image);
QUADS_OUT(5, partial);

const int kRows = 16;
const int kRead = kRows + kTaps - 1;

void main() {
    const uint x = gl_WorkGroupID.x * 8 + gl_LocalInvocationID.x, column = min(x, dims.width - 1);
    const int height = int(dims.height);
    const int top = int(gl_WorkGroupID.y) * kRows;
    const uint pairs = (dims.width + 1) / 2;
    const int odd = int(column % 2);
    int from[kRows / 8 + 2];  // blocks of 8 rows, from that above the group on
    [[unroll]] for (int k = 0; k < kRows / 8 + 2; ++k)
        from[k] = (clamp(top / 8 + k - 1, 0, (height - 1) / 8) * int(pairs) + int(column / 2)) * 16;
    vec3 d[kRead], e[kRead], f[kRead];
    float absolute = 0, squared = 0;
    vec4 by_exposure[3] = vec4[3](vec4(0), vec4(0), vec4(0));
    [[unroll]] for (int s = 0; s < kRead; ++s) {
        const int y = top + s - kTaps / 2;
        const int turn = (s + 8 - kTaps / 2) / 8, step = 2 * ((s + 8 - kTaps / 2) % 8);
        const vec4 a = LD4(rows, from[turn] * 2 + step + odd), b = LD4(rows, from[turn] * 2 + step + 16 + odd);
        const float c = uintBitsToFloat(LD1(rest, from[turn] + step + odd));
        const bool inside = y >= 0 && y < height;
        d[s] = inside ? a.xyz : vec3(0);
        e[s] = inside ? vec3(a.w, b.xy) : vec3(0);
        f[s] = inside ? vec3(b.zw, c) : vec3(0);
        const int r = s - (kTaps - 1);
        if (r < 0) continue;
        const uint at = uint(min(top + r, height - 1)) * dims.width + column;
        const uint word = LD1(truth, at);
        const vec3 drawn_color = LD4(image, dims.image + at).rgb, t = color_of(word).rgb;
        const vec3 color = exposed(drawn_color), difference = color - t;
        const vec3 by_ssim = WINDOW(d, r) + ((color + t - kPivot) * WINDOW(e, r) + difference * WINDOW(f, r));
        const vec3 gradient = dims.l1_scale * sign(difference) - dims.ssim_scale * by_ssim;
        const bool drawn = x < dims.width && top + r < height, counted = drawn && counts(word);
        const vec3 by_image = kExposure == 0 ? gradient : gradient * gains();
        if (drawn) ST4(grad_image, dims.image + at, vec4(counted ? by_image : vec3(0), 0));
        for (uint k = 0; k < 3; ++k) by_exposure[k] += counted ? gradient[k] * vec4(drawn_color, 1) : vec4(0);
        const vec3 size = abs(difference);
        absolute += counted ? size.r + size.g + size.b : 0.0;
        squared += counted ? dot(difference, difference) : 0.0;
    }
    const uint lanes = (dims.width + 7) / 8 * 8;
    const uint own = gl_WorkGroupID.y * lanes + x;
    ST4(partial, dims.first + own, vec4(absolute, 0, squared, 0));
    if (kExposure == 0) return;
    for (uint k = 0; k < 3; ++k) ST4(partial, dims.exposures + 3 * own + k, by_exposure[k]);
}
