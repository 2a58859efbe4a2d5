#include <webp/encode.h>
#include <webp/mux.h>

#include <memory>

#include "io/animation.h"

namespace splat::io {
namespace {

/// An effort of 0 to 9: the higher ones take several times as long for a few percent.
constexpr int kEffort = 2;

struct DeleteEncoder {
    void operator()(WebPAnimEncoder* encoder) const { WebPAnimEncoderDelete(encoder); }
};

/// [height,width,4] of 8 bits.
std::vector<std::uint8_t> rgba_of(const Image& frame) {
    const std::size_t pixels = std::size_t{frame.width} * frame.height;
    const std::uint32_t n = frame.channels;
    std::vector<std::uint8_t> rgba;
    rgba.reserve(4 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint16_t* const from = &frame.samples[n * i];
        for (std::uint32_t c = 0; c < 3; ++c)
            rgba.push_back(static_cast<std::uint8_t>(from[n < 3 ? 0 : c]));
        rgba.push_back(static_cast<std::uint8_t>(n % 2 == 0 ? from[n - 1] : 255));
    }
    return rgba;
}

Status add_frame(WebPAnimEncoder* encoder, const Image& frame, const WebPConfig& config, int at) {
    WebPPicture picture;
    if (WebPPictureInit(&picture) == 0) return unsupported("webp: another libwebp");
    picture.use_argb = 1;
    picture.width = static_cast<int>(frame.width);
    picture.height = static_cast<int>(frame.height);
    const std::vector<std::uint8_t> rgba = rgba_of(frame);
    const bool done = WebPPictureImportRGBA(&picture, rgba.data(), 4 * picture.width) != 0 &&
                      WebPAnimEncoderAdd(encoder, &picture, at, &config) != 0;
    WebPPictureFree(&picture);
    if (done) return {};
    return error(Code::kOutOfHostMemory, "webp: %s", WebPAnimEncoderGetError(encoder));
}

}  // namespace

Result<Buffer> write_webp_animation(const std::vector<Image>& frames,
                                    const AnimationOptions& options) {
    SPLAT_TRY(check_frames(frames, options));
    const Image& first = frames.front();
    if (first.width > kMaxWebpSide || first.height > kMaxWebpSide)
        return unsupported("webp: %u x %u pixels, the longest side is %u", first.width,
                           first.height, kMaxWebpSide);
    WebPAnimEncoderOptions settings;
    WebPConfig config;
    if (WebPAnimEncoderOptionsInit(&settings) == 0 || WebPConfigInit(&config) == 0 ||
        WebPConfigLosslessPreset(&config, kEffort) == 0)
        return unsupported("webp: another libwebp");
    config.exact = 1;  // keep the colours below alpha 0
    settings.anim_params.loop_count = static_cast<int>(options.repeats);
    const std::unique_ptr<WebPAnimEncoder, DeleteEncoder> encoder(WebPAnimEncoderNew(
        static_cast<int>(first.width), static_cast<int>(first.height), &settings));
    if (encoder == nullptr) return error(Code::kOutOfHostMemory, "webp: no memory for an encoder");
    std::int64_t at = 0;
    for (const Image& frame : frames) {
        if (at > INT32_MAX - std::int64_t{options.milliseconds})
            return unsupported("webp: the animation takes more than 2^31 ms");
        SPLAT_TRY(add_frame(encoder.get(), frame, config, static_cast<int>(at)));
        at += options.milliseconds;
    }
    WebPData file;
    WebPDataInit(&file);
    const bool done =
        WebPAnimEncoderAdd(encoder.get(), nullptr, static_cast<int>(at), nullptr) != 0 &&
        WebPAnimEncoderAssemble(encoder.get(), &file) != 0;
    const auto* const bytes = reinterpret_cast<const std::byte*>(file.bytes);
    Buffer buffer;
    if (done) buffer.assign(bytes, bytes + file.size);
    WebPDataClear(&file);
    if (!done)
        return error(Code::kOutOfHostMemory, "webp: %s", WebPAnimEncoderGetError(encoder.get()));
    return buffer;
}

}  // namespace splat::io
