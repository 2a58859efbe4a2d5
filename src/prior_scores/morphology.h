#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace splat::prior_scores {

/// Closing (dilation, then erosion) and opening (erosion, then dilation) of a binary mask by a square of 3 x 3
/// pixels: closing fills holes and gaps that no such square fits into, opening clears what no such square fits
/// into. The part of a square outside of the mask is ignored.
///
/// mask       [height, width], 0 or not; its size is the caller's to check
/// Returns    0 or 1
/// Source     Serra 1982, Image Analysis and Mathematical Morphology; borders as OpenCV's morphologyEx
std::vector<std::uint8_t> closing(std::span<const std::uint8_t> mask, std::size_t height,
                                  std::size_t width);
std::vector<std::uint8_t> opening(std::span<const std::uint8_t> mask, std::size_t height,
                                  std::size_t width);

}  // namespace splat::prior_scores
