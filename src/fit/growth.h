#pragma once

#include <span>
#include <vector>

#include "fit/fit_set.h"

namespace splat::fit {

/// Below this opacity a Gaussian is dropped.
inline constexpr float kFaint = 0.005F;

/// What `copies` Gaussians in the place of one have, so that together they draw what it drew.
struct Share {
    double opacity;
    double scale;  ///< factor of its scales
};

/// Source       Kheradmand et al. 2024, arXiv 2404.09591, eq. 9
Share share_of(double opacity, std::uint32_t copies);

/// Rows of a set that goes by opacities: faint Gaussians, and new ones up to `wanted`, take the place of others, drawn
/// in proportion to opacity, which become shares of themselves. A Gaussian has at most 51 shares, as in the authors'
/// program. Draws depend on seed and step. Nothing changes while all are faint.
std::vector<Row> relocated_rows(std::span<const Score> scores, std::uint32_t wanted,
                                std::uint64_t seed, std::uint64_t step);

/// Rows of a set that grows to `wanted`: faint Gaussians leave, and those with the largest mean screen gradients
/// become two halves each, at most half as many again as stay. Equal scores go by row, so that the choice is the same
/// everywhere. At least one row stays.
std::vector<Row> grown_rows(std::span<const Score> scores, std::uint32_t wanted);

}  // namespace splat::fit
