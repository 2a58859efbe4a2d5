#pragma once

#include <vector>

#include "core/status.h"
#include "io/image.h"
#include "splat.h"

namespace splat::api {

/// A caller's splat_image after its check, with strides that count bytes.
struct ImageView {
    std::byte* pixels = nullptr;  ///< start of the first row
    splat_pixel type = SPLAT_PIXEL_U8;
    std::uint32_t width = 0, height = 0, channels = 0;
    std::int64_t row_stride = 0, pixel_stride = 0, channel_stride = 0;  ///< bytes

    [[nodiscard]] std::size_t samples() const { return std::size_t{width} * height * channels; }
};

/// Bytes per sample; 0 for an unknown type.
std::size_t pixel_bytes(splat_pixel type);

/// A picture to read; `argument` names it in messages. Strides may repeat samples.
///
/// Errors  kInvalidArgument for NULL, an unknown type, a side outside 1 to scene::kMaxImageSide,
///         channels outside 1 to 4, a layout beyond image->bytes, and negative strides with bytes
Result<ImageView> image_to_read(const splat_image* image, const char* argument);

/// A picture to fill. Errors: as image_to_read(); kInvalidArgument if two samples share a place.
Result<ImageView> image_to_fill(const splat_image* image, const char* argument);

/// Check the size of a picture. Errors: kShape, naming `argument`, the size and the one expected.
Status check_image_size(const ImageView& view, const char* argument, std::uint32_t width,
                        std::uint32_t height, std::uint32_t channels);

/// float32 [channels,height,width] or [height,width,channels]; bytes are divided by 255.
std::vector<float> planes_of(const ImageView& view);
std::vector<float> interleaved_of(const ImageView& view);

/// Fill the picture from such numbers. Bytes are 255 v rounded to nearest and clamped; NaN gives 0.
void fill_planes(const ImageView& view, const float* planes);
void fill_interleaved(const ImageView& view, const float* values);

/// The same from pixels that begin `stride` numbers after one another.
void fill_pixels(const ImageView& view, const float* values, std::size_t stride);

/// An image of 8 bits: bytes as they are, other numbers as fill_planes() makes bytes.
io::Image image_of(const ImageView& view);

/// Fill the picture from a decoded image of the same width and height. Gray becomes RGB, and a
/// missing alpha is opaque; bytes of an image of 16 bits are rounded.
/// Errors: kShape for another size, and where channels or alpha of the image have no place.
Status fill_image(const ImageView& view, const char* argument, const io::Image& image);

}  // namespace splat::api
