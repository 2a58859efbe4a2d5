#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/status.h"

namespace splat::prior_scores {

/// Weights across the derivative: Sobel 1 2 1, Scharr 3 10 3, Prewitt 1 1 1.
enum class Gradient { kSobel, kScharr, kPrewitt };

/// Length of the gradient of a map, divided by its largest length + 1e-8: sqrt(dx^2 + dy^2), the derivatives
/// -1 0 1 across the weights of `kind`; reflected outside of the map, without its border (reflect-101).
///
/// map        [height, width]
/// Errors     kShape if the size does not fit; kInvalidArgument for numbers that are not finite
/// Precision  float64
/// Source     as OpenCV's filter2D
Result<std::vector<double>> gradient_length(std::span<const float> map, std::uint32_t height,
                                            std::uint32_t width, Gradient kind);

/// Canny's edges of a map of 0 to 1: 1 on an edge, else 0.
///
/// Sobel derivatives of trunc(255 map), repeated outside of the map, have the length |dx| + |dy|. A pixel is
/// on an edge if its length is above 50, larger than those on both sides along the gradient (one of 4
/// directions), and joined through such pixels to one above 150.
///
/// map        [height, width], 0 to 1
/// Errors     kShape if the size does not fit; kInvalidArgument for numbers outside 0 to 1
/// Precision  exact, in integers
/// Source     Canny 1986, doi:10.1109/TPAMI.1986.4767851, as OpenCV 4.6 computes it (aperture 3, L1 lengths)
Result<std::vector<std::uint8_t>> canny_edges(std::span<const float> map, std::uint32_t height,
                                              std::uint32_t width);

}  // namespace splat::prior_scores
