#pragma once

#include "ops/losses/loss.h"

namespace splat::ops {

struct SsimDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t height = 1;
    std::uint32_t width = 1;

    [[nodiscard]] QuadDims quads() const { return {n, c, height * width}; }
};

/// Structural similarity of images with values of about 0 to 1, the mean over images, channels and pixels
/// of
///
///   (2 ma mb + C1) (2 cov + C2) / ((ma^2 + mb^2 + C1) (var_a + var_b + C2))
///
/// with C1 = 0.01^2, C2 = 0.03^2, and moments under a Gaussian window of 11x11 pixels, standard deviation
/// 1.5; zero outside the image.
///
/// a, b         [N,C,H,W] float32 as quads, zero in the channels that pad a quad
/// slopes       saved for backward: by the means and the moments
/// loss         [1]; 1 for equal images
/// Errors       the recorder's, beyond the device's binding limits
/// Precision    1e-6 for images of 0 to 1, and at most 1; variances of sums of a and b are differences of
///              moments, so that gradients of flat regions lose digits (tests/ops/losses/ssim_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Wang et al. 2004, doi:10.1109/TIP.2003.819861, eq. 13
///
/// The gradient with respect to a, overwritten; derived in tests/ref/losses/ssim_ref.h.
extern const OpRow kSsimRow;

}  // namespace splat::ops
