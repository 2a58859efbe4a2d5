// Shared by the passes of ssim: the positions of the taps of its window (similarity.glsl). Everything outside the
// image is zero.

#ifndef SPLAT_SSIM_GLSL
#define SPLAT_SSIM_GLSL

#include "load.glsl"
#include "params/image_loss_params.h"
#include "losses/similarity.glsl"

layout(push_constant) uniform Push { ImageLossParams dims; };

bool tap_inside(int tap, int at, uint size) {
    const int to = at + tap - kTaps / 2;
    return to >= 0 && to < int(size);
}

// Weight of a tap `by` pixels from the pixel `at` of a line of `size`: zero outside the image.
float tap_weight(int tap, int at, uint size) {
    return tap_inside(tap, at, size) ? kWindow[tap] : 0.0;
}

// The quad of a tap along a row (step 1) or a column (step width); clamped to the image.
uint tap_quad(uint i, int tap, int at, uint size, uint step) {
    const int to = clamp(at + tap - kTaps / 2, 0, int(size) - 1);
    return uint(int(i) + (to - at) * int(step));
}

int column_of(uint i) { return int(i % dims.width); }
int row_of(uint i) { return int(i / dims.width % dims.height); }

#endif
