#pragma once

#include "io/image.h"
#include "prior_models/network.h"
#include "prior_models/preset.h"

namespace splat::prior_models {

/// A size in pixels.
struct Extent {
    std::uint32_t width = 0, height = 0;
    bool operator==(const Extent&) const = default;
};

/// The size of the input for a picture of this size.
///
/// Errors  kUnsupported for more than 2^26 pixels
/// Source  MiDaS, transforms.Resize: one factor for both sides, each rounded to the nearest multiple
Result<Extent> input_extent(const PresetInput& input, Extent picture);

/// An image of bytes in another size: bytes by Pillow's filters, numbers that are not rounded by others.
Result<std::vector<double>> resample_bytes(const io::Image& bytes, Extent size,
                                           data::ValueFilter filter);

/// A picture as input [1,3,height,width] or [1,height,width,3]: resampled, scaled and normalised in float64, then
/// float32. Gray becomes RGB; alpha is left out, as the reference does. Pillow's filters give 8-bit
/// values, others are not rounded, except "linear_origin", whose program rounds them.
///
/// Errors  kInvalidArgument for an image of 16 bits
/// Source  MiDaS's dpt_transform; rembg's normalize(); test code of the other models
Result<NetworkTensor> prepare(const PresetInput& input, const io::Image& picture, Extent size);

}  // namespace splat::prior_models
