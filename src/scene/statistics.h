#pragma once

#include <algorithm>

#include "core/status.h"
#include "scene/gaussians.h"
#include "scene/select.h"

namespace splat::scene {

/// The finite values of an attribute; all zero without any.
struct Range {
    double min = 0;
    double max = 0;
    double mean = 0;
    std::uint64_t finite = 0;
    std::uint64_t non_finite = 0;

    /// The largest magnitude.
    [[nodiscard]] double magnitude() const { return std::max(-min, max); }
};

struct Statistics {
    std::uint64_t count = 0;
    std::uint32_t sh_degree = 0;
    Box bounds;         ///< bounds of the finite means; zero without any
    Vec3 center{};      ///< median of the finite means, axis by axis
    double radius = 0;  ///< distance from the centre that holds 95 % of the finite means
    Range means;
    Range scales;                     ///< linear
    Range opacities;                  ///< 0 to 1
    Range colors;                     ///< 0.5 + kSh0 sh[0]
    Range bands;                      ///< coefficients above the constant one
    std::uint64_t non_finite = 0;     ///< values of all attributes
    std::uint64_t bad_rotations = 0;  ///< rotations of length 0, or not finite
    std::uint64_t degenerate = 0;     ///< Gaussians with a scale of 0 in float32 (or below 1e-12)
    std::uint64_t invisible = 0;      ///< Gaussians of opacity below 1/255, which are never drawn
    std::uint64_t bytes = 0;          ///< bytes of the arrays
    /// About how many Gaussians lie one behind another: the areas of all 1-sigma ellipses over the two
    /// largest scales, pi s1 s2, over the mean area of a face of the box that holds 98 % of the finite
    /// means along each axis. Where that box has no area, over the median of the ellipses instead.
    /// Infinite where a scale is. Areas of NaN are left out.
    /// Source: "fillRatio" of playcanvas/splat-transform 3.2.
    double fill_ratio = 0;
};

/// Errors: kInvalidArgument for arrays that do not fit. Determinism: sums in the order of memory.
Result<Statistics> statistics(const Gaussians& gaussians);

}  // namespace splat::scene
