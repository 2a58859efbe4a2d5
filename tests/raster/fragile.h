#pragma once

#include <vector>

#include "ref/rasterize_ref.h"

namespace splat::test {

/// Pixels where float32 rounding may decide differently from float64:
///
/// * a density next to kAlphaMin (seen or skipped) or to kAlphaMax (with or without gradient),
/// * a transmittance next to kTransmittanceMin (blended or stopped),
/// * in 3dgs, a visible Gaussian whose box ends next to the rim of a tile,
/// * with cut_3_sigma, a sigma next to 9/2,
/// * in ray_maximum, a depth next to the near plane,
/// * consecutive Gaussians with almost equal depths or, by distance, distances (exactly equal ones are in order).
///
/// "Next to" follows the terms of each number: kFragileUlps float32 roundings of sigma's three
/// terms, few of position and depth, and for the transmittance the sum over its factors. Losses put
/// no weight on these pixels, images are compared loosely there.
std::vector<bool> fragile_pixels(const ref::RasterScene<double>& scene);

/// The same for selected pixels, given as row * width + column.
std::vector<bool> fragile_pixels(const ref::RasterScene<double>& scene,
                                 const std::vector<std::size_t>& pixels);

/// Many times the rounding of float32 arithmetic, as exp() of some devices is off by dozens of ulps
/// and the conics of needles by 60. Still few pixels are excluded.
inline constexpr double kFragileUlps = 256;

}  // namespace splat::test
