#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::data {

/// How the numbers of an image become those of another size. The first five sample between neighbours at
/// any factor; Pillow's kernels widen when they reduce.
enum class ValueFilter {
    kNearest,        ///< Pillow's: sample floor((i + 0.5) from / to)
    kLinear,         ///< PyTorch's bilinear, middles of pixels at halves
    kLinearCorners,  ///< PyTorch's bilinear with align_corners
    kLinearOrigin,   ///< sample i from / to: corners at the origin
    kCubic,          ///< OpenCV's INTER_CUBIC and PyTorch's bicubic: a = -0.75
    kPillowBilinear,
    kPillowBicubic,
    kPillowLanczos,
};

/// "nearest", "linear", "linear_corners", "linear_origin", "cubic", "pillow_bilinear", ...; nothing for another
/// name.
std::optional<ValueFilter> value_filter_of(const std::string& name);

/// The names, for messages.
std::string value_filter_names();

/// Numbers [height,width,channels] in another size, without rounding or clamping; samples beyond the
/// edge repeat it. T: std::uint16_t, float.
///
/// Errors        kInvalidArgument for sides of 0, or another number of values
/// Precision     float64
template <class T>
Result<std::vector<double>> resample_values(std::span<const T> values, std::uint32_t width,
                                            std::uint32_t height, std::uint32_t channels,
                                            std::uint32_t to_width, std::uint32_t to_height,
                                            ValueFilter filter);

}  // namespace splat::data
