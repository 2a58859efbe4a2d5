#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/status.h"
#include "io/image.h"

namespace splat::data {

/// Kernels of Pillow's Image.resize; a reduction widens them by its factor.
enum class Filter { kBox, kBilinear, kBicubic, kLanczos };

/// An image of 8 bits in another size: the rows are resampled first, then the columns, each rounded to 8
/// bits, with weights of 22 bits. Colours are weighted by their alpha.
///
/// Errors        kInvalidArgument for an image of 16 bits or a side of 0
/// Precision     the same bytes as Pillow 9 to 11
/// Source        Pillow's documentation, "Filters"; its fixed-point form is described in
///               tests/data/resample_test.cpp, which compares with values of Pillow
Result<io::Image> resample(const io::Image& image, std::uint32_t width, std::uint32_t height,
                           Filter filter);

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
