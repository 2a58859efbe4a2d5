#include "io/animation.h"

#include <gtest/gtest.h>
#include <webp/demux.h>

#include <memory>

#include "support/expect_status.h"

namespace splat::io {
namespace {

struct CloseDecoder {
    void operator()(WebPAnimDecoder* decoder) const { WebPAnimDecoderDelete(decoder); }
};

/// Another reader: libwebp's.
struct Played {
    std::vector<std::vector<std::uint8_t>> frames;  ///< RGBA
    std::vector<int> ends;                          ///< ms
    WebPAnimInfo info{};

    explicit Played(const Buffer& file) {
        const WebPData data{reinterpret_cast<const std::uint8_t*>(file.data()), file.size()};
        const std::unique_ptr<WebPAnimDecoder, CloseDecoder> decoder(
            WebPAnimDecoderNew(&data, nullptr));
        if (decoder == nullptr || WebPAnimDecoderGetInfo(decoder.get(), &info) == 0) return;
        std::uint8_t* pixels = nullptr;
        for (int end = 0; WebPAnimDecoderGetNext(decoder.get(), &pixels, &end) != 0;) {
            frames.emplace_back(pixels,
                                pixels + std::size_t{4} * info.canvas_width * info.canvas_height);
            ends.push_back(end);
        }
    }
};

Image noise(std::uint32_t channels, unsigned start) {
    Image image{13, 7, channels, 8, {}};
    for (std::size_t i = 0; i < std::size_t{13} * 7 * channels; ++i)
        image.samples.push_back(static_cast<std::uint16_t>((start + 37 * i + i * i / 3) % 256));
    return image;
}

TEST(WebpAnimation, FramesComeBackToTheBit) {
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
        const std::vector<Image> frames = {noise(channels, 3), noise(channels, 90),
                                           noise(channels, 150)};
        auto file = need(write_webp_animation(frames, {70, 0}));
        const Played played(file);
        ASSERT_EQ(played.frames.size(), 3U) << channels << " channels";
        EXPECT_EQ(played.info.loop_count, 0U) << "for ever";
        EXPECT_EQ(played.ends, (std::vector<int>{70, 140, 210}));
        for (std::size_t f = 0; f < 3; ++f)
            for (std::size_t i = 0; i < 13 * 7; ++i) {
                const std::uint16_t* const from = &frames[f].samples[channels * i];
                const unsigned alpha = channels % 2 == 0 ? from[channels - 1] : 255;
                ASSERT_EQ(played.frames[f][4 * i + 3], alpha);
                if (alpha != 255) continue;  // players blend over what was before
                for (std::uint32_t c = 0; c < 3; ++c)
                    ASSERT_EQ(played.frames[f][4 * i + c], from[channels < 3 ? 0 : c]);
            }
    }
}

TEST(WebpAnimation, EqualFramesKeepTheirTime) {
    auto file = need(write_webp_animation({noise(3, 1), noise(3, 1), noise(3, 8)}, {50, 2}));
    const Played played(file);
    EXPECT_EQ(played.ends, (std::vector<int>{100, 150})) << "of one image less";
}

TEST(WebpAnimation, FramesThatDifferInSizeAndLongSidesAreRefused) {
    Image other = noise(3, 1);
    other.width = 7;
    other.height = 13;
    EXPECT_EQ(write_webp_animation({noise(3, 1), other}).status().code(), Code::kInvalidArgument);
    EXPECT_EQ(write_webp_animation({}).status().code(), Code::kInvalidArgument);
    const Image wide{kMaxWebpSide + 1, 1, 1, 8,
                     std::vector<std::uint16_t>(std::size_t{kMaxWebpSide} + 1, 9)};
    EXPECT_EQ(write_webp_animation({wide}).status().code(), Code::kUnsupported);
}

}  // namespace
}  // namespace splat::io
