#pragma once

#include <cstdint>
#include <span>

#include "core/status.h"

namespace splat::data {

inline constexpr std::uint32_t kPlaneChannels = 5;
/// Planes of a map; `vkrun priors plane` finds no more.
inline constexpr std::uint32_t kMostPlanes = 255;
/// Normals of maps have lengths near 1; shorter ones stand for none, as in maps of normals.
inline constexpr double kLeastNormal = 0.5;

/// Check [height,width,4] of bytes. Errors: kFormat, with the pixel, for more than kMostPlanes planes, and for a plane
/// whose normal is shorter than kLeastNormal.
Status check_planes(std::span<const std::uint16_t> map, std::uint32_t width);

/// The channels of planes that a network sees, of a map of planes: (n + 1) / 2 of the plane's normal, its distance,
/// and its id, (place + 1) / planes of the map. Places count from 0, by descending pixels, then by the first pixel.
///
/// map        [R,R,4]: the numbers of a plane, which all its pixels share; a last one of 0 is no plane
/// channels   [5,R,R], 0 to 1; all 0 where there is no plane
/// Precision  bytes / 255 and ids rounded to float32
void plane_channels(std::span<const std::uint8_t> map, std::span<float> channels);

}  // namespace splat::data
