// Shared by the passes of ssim: the window, a Gaussian of standard deviation 1.5 over 11 pixels with sum 1,
// and the positions of its taps. Everything outside the image is zero.
//
// The passes take p = a + b - kPivot and q = a - b in the place of a and b:
//   2 ma mb = (mp^2 - mq^2) / 2      ma^2 + mb^2 = (mp^2 + mq^2) / 2, mp the mean of a + b
//   2 cov = (vp - vq) / 2            va + vb = (vp + vq) / 2
// No rounding can make S exceed 1, as vq >= 0, and 1 - S does not cancel: of alike images q is small. A variance
// E[x^2] - m^2 of a and b themselves is 6e-8 off near white, 7e-5 of C2.

#ifndef SPLAT_SSIM_GLSL
#define SPLAT_SSIM_GLSL

#include "load.glsl"
#include "params/image_loss_params.h"

layout(push_constant) uniform Push { ImageLossParams dims; };

const float kPivot = 1.0;  // halves a + b of images from 0 to 1
const int kTaps = 11;
const float kWindow[kTaps] =
    float[](0.00102838008447911, 0.007598758135239185, 0.03600077212843083, 0.10936068950970002,
            0.2130055377112537, 0.26601172486179436, 0.2130055377112537, 0.10936068950970002,
            0.03600077212843083, 0.007598758135239185, 0.00102838008447911);

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
