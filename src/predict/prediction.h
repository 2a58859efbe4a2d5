#pragma once

#include "core/status.h"
#include "scene/gaussians.h"

namespace splat::predict {

/// Opacities below this do not show in 8 bits.
inline constexpr double kLeastOpacity = 1.0 / 255;

/// The Gaussians of a prediction that an image can show.
struct Visible {
    scene::Gaussians gaussians;
    std::uint64_t not_finite = 0;  ///< left out: NaN, infinities, rotations of length 0
    std::uint64_t faint = 0;       ///< left out: opacity below kLeastOpacity
};

/// Errors: those of scene::remove_invalid.
Result<Visible> visible_of(const scene::Gaussians& predicted);

}  // namespace splat::predict
