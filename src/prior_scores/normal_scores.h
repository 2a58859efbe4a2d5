#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/status.h"

namespace splat::prior_scores {

/// Angles between predicted and true normals, in degrees.
struct NormalScores {
    double mean = 0;
    double median = 0;  ///< median; for an even count the mean of the middle two
    double rmse = 0;
    std::array<double, 3>
        within{};               ///< share of pixels with an angle below 11.25, 22.5, 30 degrees
    std::uint64_t pixels = 0;   ///< counted
    std::uint64_t missing = 0;  ///< counted pixels without a prediction; their angle is 180 degrees
};

/// Compare normal maps. Lengths do not matter, but a vector shorter than 0.5 stands for none.
///
/// prediction, truth   [3, pixels]
/// mask       pixels > 0.5 count, and must have a true normal; empty: those with a true normal
/// Errors     kShape if the sizes do not fit; kInvalidArgument if no pixel counts, for numbers that are not
///            finite (outside of a mask nothing is read) and for no true normal inside of a mask
/// Precision  float64
/// Source     Fouhey et al. 2013, doi:10.1109/ICCV.2013.421, section 5
Result<NormalScores> compare_normals(std::span<const float> prediction,
                                     std::span<const float> truth,
                                     std::span<const float> mask = {});

}  // namespace splat::prior_scores
