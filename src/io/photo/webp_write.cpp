#include <webp/encode.h>

#include <memory>

#include "io/photo/photo.h"

namespace splat::io {
namespace {

/// An effort of 0 to 9: higher ones take several times as long for one percent.
constexpr int kLosslessEffort = 3;

struct FreePicture {
    void operator()(WebPPicture* picture) const { WebPPictureFree(picture); }
};

struct ClearWriter {
    void operator()(WebPMemoryWriter* writer) const { WebPMemoryWriterClear(writer); }
};

}  // namespace

Result<Buffer> write_webp(std::span<const std::uint8_t> rgba, std::uint32_t width,
                          std::uint32_t height) {
    if (width == 0 || height == 0 || width > kLongestWebpSide || height > kLongestWebpSide ||
        rgba.size() != std::size_t{4} * width * height)
        return invalid(
            "webp: %zu bytes for %u x %u pixels, expected 4 for each of 1 to %u on a side",
            rgba.size(), width, height, kLongestWebpSide);
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter writer;
    if (WebPConfigInit(&config) == 0 || WebPConfigLosslessPreset(&config, kLosslessEffort) == 0 ||
        WebPPictureInit(&picture) == 0)
        return unsupported("webp: another libwebp");
    config.exact = 1;  // keep the colours below alpha 0
    WebPMemoryWriterInit(&writer);
    const std::unique_ptr<WebPPicture, FreePicture> free_picture(&picture);
    const std::unique_ptr<WebPMemoryWriter, ClearWriter> clear_writer(&writer);
    picture.use_argb = 1;
    picture.width = static_cast<int>(width);
    picture.height = static_cast<int>(height);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    if (WebPPictureImportRGBA(&picture, rgba.data(), 4 * picture.width) == 0 ||
        WebPEncode(&config, &picture) == 0)
        return error(Code::kOutOfHostMemory,
                     "webp: libwebp's error %d while %u x %u pixels are written",
                     picture.error_code, width, height);
    const auto* const bytes = reinterpret_cast<const std::byte*>(writer.mem);
    return Buffer(bytes, bytes + writer.size);
}

}  // namespace splat::io
