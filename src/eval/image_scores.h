#pragma once

#include <cstdint>
#include <span>

#include "core/status.h"

namespace splat::eval {

struct ImageScores {
    double squared_error = 0;
    double psnr = 0;  ///< dB; infinite for equal images
    double ssim = 0;
};

/// Similarity of two images with values of about 0 to 1.
///
///   psnr = -10 log10 mean (a - b)^2
///   ssim = mean of (2 ma mb + C1) (2 cov + C2) / ((ma^2 + mb^2 + C1) (var_a + var_b + C2)),
///          C1 = 0.01^2, C2 = 0.03^2, moments under a Gaussian window of 11 x 11 pixels with standard
///          deviation 1.5; zero outside the image
///
/// a, b         [channels, height, width]
/// valid        [height, width], 0 where a pixel does not count, and both images are 0 for the windows of others;
///              empty: all count
/// Errors       kShape if the sizes do not fit, kInvalidArgument for numbers that are not finite
/// Precision    float64
/// Determinism  bit-exact
/// Source       Wang et al. 2004, doi:10.1109/TIP.2003.819861, eq. 13, with the zero padding of Splatter
///              Image's evaluation
Result<ImageScores> compare_images(std::span<const float> a, std::span<const float> b,
                                   std::uint32_t channels, std::uint32_t height,
                                   std::uint32_t width, std::span<const std::uint8_t> valid = {});

}  // namespace splat::eval
