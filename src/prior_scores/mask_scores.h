#pragma once

#include <cstdint>
#include <span>

#include "core/status.h"

namespace splat::prior_scores {

/// How well a soft mask p from 0 to 1, binary P = p > 0.5, covers the true one G.
struct MaskScores {
    double mae = 0;                      ///< mean of |p - G|
    double iou = 0;                      ///< |P and G| / (|P or G| + 1e-6)
    double precision = 0;                ///< |P and G| / (|P| + 1e-6)
    double recall = 0;                   ///< |P and G| / (|G| + 1e-6)
    double f_beta = 0;                   ///< 1.3 precision recall / (0.3 precision + recall + 1e-6)
    std::uint64_t predicted_pixels = 0;  ///< |P|
    std::uint64_t true_pixels = 0;       ///< |G|; with 0 every share is 0, even for an empty P
};

/// Compare a mask with the true one, which is where `alpha` is above `threshold`.
///
/// prediction, alpha   of one size, 0 to 1
/// Errors     kShape if the sizes differ; kInvalidArgument for a number outside 0 to 1
/// Precision  float64
/// Source     Achanta et al. 2009, doi:10.1109/CVPR.2009.5206596, eq. 6 with beta^2 = 0.3; the 1e-6 as in the
///            published scores of Splatter Image with priors
Result<MaskScores> compare_masks(std::span<const float> prediction, std::span<const float> alpha,
                                 double threshold = 0);

}  // namespace splat::prior_scores
