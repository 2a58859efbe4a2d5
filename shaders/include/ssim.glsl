// Shared by the passes of ssim: the window, a Gaussian of standard deviation 1.5 over 11 pixels with sum 1,
// and the positions of its taps. Everything outside the image is zero.

#ifndef SPLAT_SSIM_GLSL
#define SPLAT_SSIM_GLSL

#include "load.glsl"
#include "params/image_loss_params.h"

layout(push_constant) uniform Push { ImageLossParams dims; };

const int kTaps = 11;
const float kWindow[kTaps] =
    float[](0.00102838008447911, 0.007598758135239185, 0.03600077212843083, 0.10936068950970002,
            0.2130055377112537, 0.26601172486179436, 0.2130055377112537, 0.10936068950970002,
            0.03600077212843083, 0.007598758135239185, 0.00102838008447911);

// Weight of a tap `by` pixels from the pixel `at` of a line of `size`: zero outside the image.
float tap_weight(int tap, int at, uint size) {
    const int to = at + tap - kTaps / 2;
    return to >= 0 && to < int(size) ? kWindow[tap] : 0.0;
}

// The quad of a tap along a row (step 1) or a column (step width); clamped to the image.
uint tap_quad(uint i, int tap, int at, uint size, uint step) {
    const int to = clamp(at + tap - kTaps / 2, 0, int(size) - 1);
    return uint(int(i) + (to - at) * int(step));
}

int column_of(uint i) { return int(i % dims.width); }
int row_of(uint i) { return int(i / dims.width % dims.height); }

#endif
