#pragma once

#include <span>
#include <vector>

#include "fit/fit_set.h"

namespace splat::fit {

/// Below this opacity a Gaussian is dropped.
inline constexpr float kFaint = 0.005F;

/// Rows of a set that grows to `wanted`: faint Gaussians leave, and those with the largest mean screen gradients
/// become two halves each, at most half as many again as stay. Equal scores go by row, so that the choice is the same
/// everywhere. At least one row stays.
std::vector<Row> grown_rows(std::span<const Score> scores, std::uint32_t wanted);

}  // namespace splat::fit
