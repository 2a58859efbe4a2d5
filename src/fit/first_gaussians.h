#pragma once

#include <span>

#include "core/status.h"
#include "io/colored_points.h"
#include "scene/camera.h"
#include "scene/gaussians.h"

namespace splat::fit {

/// One Gaussian at each point, or at `most` of them drawn by the seed: round, as large as the root mean square
/// distance to the three nearest points, opacity 0.1, of the point's colour.
///
/// Errors       kInvalidArgument for fewer than two points
/// Determinism  the same bits everywhere
/// Source       Kerbl et al. 2023, section 5.1
Result<scene::Gaussians> first_gaussians(const io::ColoredPoints& points, std::uint32_t most,
                                         std::uint64_t seed);

/// Gray points for scenes without any: uniform in the cube around the place that the cameras look at (the least
/// squares of their axes, or in front of them if these are parallel), whose side is their mean distance from it. At
/// least two cameras see each; there may be fewer than `count`.
io::ColoredPoints random_points(std::span<const scene::Camera> cameras, std::uint32_t count,
                                std::uint64_t seed);

}  // namespace splat::fit
