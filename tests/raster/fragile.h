#pragma once

#include <vector>

#include "ref/rasterize_ref.h"

namespace splat::test {

/// Pixels that the rounding of a float32 computation may decide otherwise than float64 does:
///
/// * a density next to kAlphaMin (seen or skipped) or to kAlphaMax (gradient or none),
/// * a transmittance next to kTransmittanceMin (blended or stopped),
/// * in 3dgs, a visible Gaussian whose box ends next to the rim of a tile,
/// * two Gaussians in a row with depths that differ by next to nothing; equal ones are in order.
///
/// "Next to" follows the terms of each number: kFragileUlps float32 roundings of sigma's three
/// terms, few of position and depth, and for the transmittance the sum over its factors. Losses put
/// no weight on these pixels, images are compared loosely there.
std::vector<bool> fragile_pixels(const ref::RasterScene<double>& scene);

/// The same for some pixels only, given as row * width + column.
std::vector<bool> fragile_pixels(const ref::RasterScene<double>& scene,
                                 const std::vector<std::size_t>& pixels);

/// Many times what float32 arithmetic costs, as exp() of some devices is off by dozens of ulps and
/// the conics of needles by 60; yet few pixels are lost.
inline constexpr double kFragileUlps = 256;

}  // namespace splat::test
