#pragma once

#include <cstdint>
#include <span>

namespace splat::data {

inline constexpr std::uint32_t kPlaneChannels = 5;

/// The channels of planes that a network sees, of a map of planes: (n + 1) / 2 of the plane's normal, its distance,
/// and its id, (place + 1) / planes of the map. Planes are ordered by descending pixels, then by their first pixel.
///
/// map        [R,R,4]: the numbers of a plane, which all its pixels share; a last one of 0 is no plane
/// channels   [5,R,R], 0 to 1; all 0 where there is no plane
/// Precision  bytes / 255 and ids rounded to float32
void plane_channels(std::span<const std::uint8_t> map, std::span<float> channels);

}  // namespace splat::data
