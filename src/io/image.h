#pragma once

#include <cstdint>

#include "core/decode_budget.h"
#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// Pixels in host memory, row by row from the top, channels together.
struct Image {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t channels = 0;          ///< 1 gray, 2 gray + alpha, 3 RGB, 4 RGB + alpha
    std::uint32_t bits = 8;              ///< 8 or 16
    std::vector<std::uint16_t> samples;  ///< [height,width,channels], 0 to 2^bits - 1
    double focal = 0;                    ///< pixels, of a photograph's Exif data; 0: not known
};

struct ImageOptions {
    std::uint32_t max_side = 16384;  ///< pixels; larger images are refused
    std::uint64_t max_samples = std::uint64_t{1} << 30;
    bool upright = false;      ///< turn JPEG files by their Exif orientation
    bool square = false;       ///< refuse others
    bool header_only = false;  ///< leave the samples empty, and what follows the header unread
    DecodeLimits limits = decode_limits();
};

/// What a reader checks when it knows all but the samples, before it decodes any: the options, and that the
/// samples and `more_bytes` fit the budget of a file of `file_bytes`. This holds with header_only, too: its caller
/// may make room for the samples. Errors: kUnsupported above max_side and
/// max_samples; kFormat, as DecodeBudget::take(), and if it is not square.
Status check_header(const Image& image, const ImageOptions& options, std::uint64_t more_bytes,
                    std::uint64_t file_bytes, const char* format);

/// Allocates the samples of an image of 8 bits. Returns where its bytes belong: the upper half of the same
/// memory.
std::uint8_t* make_byte_samples(Image& image);

/// Bytes that were put there become the samples.
void spread_byte_samples(Image& image);

/// A PNG file of any colour type and depth: palettes become RGB, fewer than 8 bits become 8, a
/// transparent colour becomes alpha. Values are as stored: no gamma, no colour profile.
///
/// Errors       kFormat if it is not a PNG, damaged (libpng's sentence) or truncated;
///              as check_header()
Result<Image> read_png(Bytes file, const ImageOptions& options = {});

/// kFast takes a fifth of the time; files of drawn images become a third larger.
enum class PngEffort { kSmall, kFast };

/// 8 or 16 bits of 1 to 4 channels. Errors: kInvalidArgument if the samples do not fit the size or a value
/// the bits.
Result<Buffer> write_png(const Image& image, PngEffort effort = PngEffort::kSmall);

/// Image of linear values: 255 v (65535 v for 16 bits) rounded to nearest, clamped; NaN gives 0. `values` is
/// [height,width,channels].
Image image_from_floats(std::span<const float> values, std::uint32_t width, std::uint32_t height,
                        std::uint32_t channels, std::uint32_t bits = 8);

/// Errors: kInvalidArgument if the number of samples, channels or bits breaks the rules above.
Status check_image(const Image& image);

}  // namespace splat::io
