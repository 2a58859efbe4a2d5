#include "io/photo/webp.h"

#include <webp/decode.h>

namespace splat::io {

Result<Image> read_webp(Bytes file, const ImageOptions& options) {
    const auto* const data = reinterpret_cast<const std::uint8_t*>(file.data());
    WebPBitstreamFeatures features;
    const VP8StatusCode status = WebPGetFeatures(data, file.size(), &features);
    if (status != VP8_STATUS_OK)
        return error(Code::kFormat, "webp: %s",
                     status == VP8_STATUS_NOT_ENOUGH_DATA
                         ? "the file is truncated"
                         : "the file does not start like a WebP file");
    if (features.has_animation != 0)
        return error(Code::kUnsupported, "webp: an animation, expected one image");
    Image image;
    image.width = static_cast<std::uint32_t>(features.width);
    image.height = static_cast<std::uint32_t>(features.height);
    image.channels = features.has_alpha != 0 ? 4 : 3;
    const std::uint64_t samples = std::uint64_t{image.width} * image.height * image.channels;
    if (image.width > options.max_side || image.height > options.max_side ||
        samples > options.max_samples)
        return error(Code::kUnsupported,
                     "webp: %u x %u pixels, the limit is %u on a side, %llu samples", image.width,
                     image.height, options.max_side,
                     static_cast<unsigned long long>(options.max_samples));
    if (options.header_only) return image;
    std::vector<std::uint8_t> rows(samples);
    const int stride = static_cast<int>(image.width * image.channels);
    const auto* const decoded =
        image.channels == 4
            ? WebPDecodeRGBAInto(data, file.size(), rows.data(), rows.size(), stride)
            : WebPDecodeRGBInto(data, file.size(), rows.data(), rows.size(), stride);
    if (decoded == nullptr) return error(Code::kFormat, "webp: the file is damaged or truncated");
    image.samples.assign(rows.begin(), rows.end());
    return image;
}

}  // namespace splat::io
