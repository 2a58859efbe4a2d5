#include "io/photo/photo.h"

#include <webp/decode.h>

namespace splat::io {
namespace {

/// libwebp reads bare bit streams, too; a file is as RFC 9649, section 2, says.
bool has_container(Bytes file) {
    const std::string_view text = as_text(file);
    if (!text.starts_with("RIFF") || text.size() < 16) return false;
    const std::string_view first = text.substr(12, 4);
    return first == "VP8 " || first == "VP8L" || first == "VP8X";
}

}  // namespace

Result<Image> read_webp(Bytes file, const ImageOptions& options) {
    const auto* const data = reinterpret_cast<const std::uint8_t*>(file.data());
    WebPBitstreamFeatures features;
    const VP8StatusCode status = WebPGetFeatures(data, file.size(), &features);
    if (status != VP8_STATUS_OK)
        return damaged("webp: %s", status == VP8_STATUS_NOT_ENOUGH_DATA
                                       ? "the file is truncated"
                                       : "the file does not start like a WebP file");
    if (features.has_animation != 0) return unsupported("webp: an animation, expected one image");
    Image image;
    image.width = static_cast<std::uint32_t>(features.width);
    image.height = static_cast<std::uint32_t>(features.height);
    image.channels = features.has_alpha != 0 ? 4 : 3;
    if (!has_container(file)) return damaged("webp: the file has no image, or is truncated");
    SPLAT_TRY(check_header(image, options, 0, file.size(), "webp"));
    if (options.header_only) return image;
    std::uint8_t* const rows = make_byte_samples(image);
    const int stride = static_cast<int>(image.width * image.channels);
    const auto* const decoded = (image.channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto)(
        data, file.size(), rows, image.samples.size(), stride);
    if (decoded == nullptr) return damaged("webp: the file is damaged or truncated");
    spread_byte_samples(image);
    return image;
}

}  // namespace splat::io
