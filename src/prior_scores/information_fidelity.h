#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/status.h"

namespace splat::prior_scores {

/// Smallest side that the four scales leave room for.
inline constexpr std::uint32_t kLeastFidelitySide = 41;

struct FidelityOptions {
    /// Range of the values that are compared: 255 multiplies images of 0 to 1 by 255, as the noise variance 2 of the
    /// definition expects; 1 leaves them, as the published scores of Splatter Image with priors did.
    double range = 255;
    /// With 2 or 4 channels, the last is averaged in like any other, as in those scores; where both are constant
    /// and equal it counts as 1. Else it is left out.
    bool alpha_counts = false;
};

struct FidelityScores {
    double vif = 0;                ///< mean over the channels that have one; NaN if none has
    std::vector<double> channels;  ///< NaN: the true channel is constant
    std::uint32_t constant = 0;    ///< channels left out for that
};

/// Visual information fidelity in the pixel domain of each channel, 1 for equal images:
///
///   VIF = sum log10(1 + g^2 s_t / (s_v + 2)) / sum log10(1 + s_t / 2),  g = s_pt / (s_t + 1e-10),
///         s_v = s_p - g s_pt
///
/// over all places of four scales; the (co)variances s under Gaussian windows of 17, 9, 5 and 3 pixels with
/// standard deviations of a fifth of that, inside of the image only. Before a scale but the first both images
/// are filtered with its window and every other pixel is kept.
///
/// prediction, truth   [channels, height, width], 0 to 1
/// Errors     kShape if the sizes do not fit or a side is below kLeastFidelitySide; kInvalidArgument for numbers
///            that are not finite
/// Precision  float64
/// Source     Sheikh and Bovik 2006, doi:10.1109/TIP.2005.859378, and their pixel-domain version vifp
Result<FidelityScores> information_fidelity(std::span<const float> prediction,
                                            std::span<const float> truth, std::uint32_t channels,
                                            std::uint32_t height, std::uint32_t width,
                                            const FidelityOptions& options = {});

}  // namespace splat::prior_scores
