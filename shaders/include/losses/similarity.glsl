// Structural similarity at a pixel from moments under the window, a Gaussian of standard deviation 1.5 over 11 pixels
// with sum 1. Everything outside the image is zero.
//
// The moments are those of p = a + b - kPivot and q = a - b in the place of a and b:
//   2 ma mb = (mp^2 - mq^2) / 2      ma^2 + mb^2 = (mp^2 + mq^2) / 2, mp the mean of a + b
//   2 cov = (vp - vq) / 2            va + vb = (vp + vq) / 2
// No rounding can make S exceed 1, as vq >= 0, and 1 - S does not cancel: of alike images q is small. A variance
// E[x^2] - m^2 of a and b themselves is 6e-8 off near white, 7e-5 of C2.

#ifndef SPLAT_SIMILARITY_GLSL
#define SPLAT_SIMILARITY_GLSL

const float kPivot = 1.0;  // halves a + b of images from 0 to 1
const int kTaps = 11;
const float kWindow[kTaps] =
    float[](0.00102838008447911, 0.007598758135239185, 0.03600077212843083, 0.10936068950970002,
            0.2130055377112537, 0.26601172486179436, 0.2130055377112537, 0.10936068950970002,
            0.03600077212843083, 0.007598758135239185, 0.00102838008447911);
const float kC1 = 1e-4;
const float kC2 = 9e-4;

struct Similarity {
    vec4 luminance, structure;  // S is their product
    vec4 unlike;                // 1 - S
    vec4 slopes[3];             // the derivatives of S by the means, E[p^2] and E[q^2]
};

// From the means of p, p^2, q and q^2:
//   S = A1 A2 / (B1 B2),  A1 = 2 ma mb + C1, A2 = 2 cov + C2, B1 = ma^2 + mb^2 + C1, B2 = va + vb + C2
Similarity similarity(vec4 m[4]) {
    const vec4 mp = m[0] + kPivot, mq = m[2];
    const vec4 vp = max(m[1] - m[0] * m[0], vec4(0)), vq = max(m[3] - mq * mq, vec4(0));
    const vec4 a1 = 0.5 * (mp * mp - mq * mq) + kC1, b1 = 0.5 * (mp * mp + mq * mq) + kC1;
    const vec4 a2 = 0.5 * (vp - vq) + kC2, b2 = 0.5 * (vp + vq) + kC2;
    const vec4 luminance = a1 / b1, structure = a2 / b2;
    // b1 - a1 = mq^2 and b2 - a2 = vq
    const vec4 by_vp = 0.5 * luminance * vq / (b2 * b2), by_vq = -0.5 * luminance * (vp + 2 * kC2) / (b2 * b2);
    const vec4 by_means = structure * mq * (mp * mq - mp * mp - 2 * kC1) / (b1 * b1);
    const vec4 unlike = mq * mq / b1 + luminance * (vq / b2);
    return Similarity(luminance, structure, unlike,
                      vec4[](by_means - 2 * (m[0] * by_vp + mq * by_vq), by_vp, by_vq));
}

#endif
