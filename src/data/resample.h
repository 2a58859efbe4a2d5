#pragma once

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

}  // namespace splat::data
