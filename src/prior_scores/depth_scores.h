#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/status.h"

namespace splat::prior_scores {

/// Errors of a depth map, in the truth's units where they have one.
struct DepthScores {
    double abs_rel = 0;              ///< mean of |p - g| / g
    double rmse = 0;                 ///< root of the mean of (p - g)^2
    double si_rmse = 0;              ///< standard deviation of ln p - ln g
    std::array<double, 3> within{};  ///< share of pixels with max(p/g, g/p) < 1.25, 1.25^2, 1.25^3
    double scale = 0;                ///< factor of the alignment; 0 for a constant prediction
    double shift = 0;
    std::uint64_t pixels = 0;  ///< counted
};

enum class DepthRule {
    /// Pixels of the mask count, or without one those where the truth is > 0. An aligned depth of 0 or less is
    /// within no factor.
    kValid,
    /// The way the scores of Splatter Image with priors were made: both maps are first clamped to 1e-8, which makes
    /// every pixel count, and an aligned depth below 0 is within every factor.
    kPublished
};

/// Compare a depth map with the true one after the alignment p = scale * prediction + shift with the least
/// squares of p - g (Ranftl et al. 2022, doi:10.1109/TPAMI.2020.3019967, section 5).
///
/// ln p       of max(p, 1e-8)
/// prediction, truth   of one size; larger means the same in both (inverse depths with inverse depths)
/// mask       pixels > 0.5 count; empty: as the rule says. kPublished takes none
/// Errors     kShape if the sizes differ; kInvalidArgument if no pixel counts, for numbers that are not finite
///            (outside of a mask nothing is read) and for a truth that is not > 0 inside of a mask
/// Precision  float64
Result<DepthScores> compare_depth(std::span<const float> prediction, std::span<const float> truth,
                                  std::span<const float> mask = {},
                                  DepthRule rule = DepthRule::kValid);

}  // namespace splat::prior_scores
