#include "io/animation.h"

#include <gif_lib.h>
#include <gtest/gtest.h>

#include "support/expect_status.h"

namespace splat::io {
namespace {

/// Another reader: giflib's.
class Decoded {
  public:
    explicit Decoded(Bytes file) : left_(file) {
        int failed = 0;
        gif_ = DGifOpen(this, read, &failed);
        if (gif_ != nullptr && DGifSlurp(gif_) != GIF_OK) close();
    }
    Decoded(const Decoded&) = delete;
    Decoded& operator=(const Decoded&) = delete;
    ~Decoded() { close(); }

    [[nodiscard]] const GifFileType* gif() const { return gif_; }
    [[nodiscard]] const SavedImage& frame(int i) const { return gif_->SavedImages[i]; }

    [[nodiscard]] GifColorType color(int i, std::size_t pixel) const {
        return gif_->SColorMap->Colors[frame(i).RasterBits[pixel]];
    }

  private:
    static int read(GifFileType* gif, GifByteType* to, int count) {
        Bytes& left = static_cast<Decoded*>(gif->UserData)->left_;
        const std::size_t taken = std::min(left.size(), static_cast<std::size_t>(count));
        std::memcpy(to, left.data(), taken);
        left = left.subspan(taken);
        return static_cast<int>(taken);
    }
    void close() {
        if (gif_ != nullptr) DGifCloseFile(gif_, nullptr);
        gif_ = nullptr;
    }

    Bytes left_;
    GifFileType* gif_ = nullptr;
};

Image ramp(std::uint32_t width, std::uint32_t height, std::uint32_t channels, unsigned start) {
    Image image{width, height, channels, 8, {}};
    for (std::size_t i = 0; i < std::size_t{width} * height * channels; ++i)
        image.samples.push_back(static_cast<std::uint16_t>((start + 7 * i) % 256));
    return image;
}

Image constant(std::uint16_t red, std::uint16_t green, std::uint16_t blue) {
    Image image{16, 16, 3, 8, {}};
    for (int i = 0; i < 256; ++i) image.samples.insert(image.samples.end(), {red, green, blue});
    return image;
}

TEST(Gif, GrayIsExactAndPlaysAsAsked) {
    const std::vector<Image> frames = {ramp(9, 5, 1, 0), ramp(9, 5, 1, 100), ramp(9, 5, 1, 200)};
    const auto file = need(write_gif(frames, {40, 3}));
    const Decoded decoded(file);
    ASSERT_NE(decoded.gif(), nullptr);
    EXPECT_EQ(decoded.gif()->SWidth, 9);
    EXPECT_EQ(decoded.gif()->SHeight, 5);
    ASSERT_EQ(decoded.gif()->ImageCount, 3);
    for (int i = 0; i < 3; ++i) {
        for (std::size_t p = 0; p < 45; ++p)
            EXPECT_EQ(decoded.color(i, p).Green, frames[static_cast<std::size_t>(i)].samples[p]);
        GraphicsControlBlock control{};
        ASSERT_EQ(DGifSavedExtensionToGCB(const_cast<GifFileType*>(decoded.gif()), i, &control),
                  GIF_OK);
        EXPECT_EQ(control.DelayTime, 4);
        EXPECT_EQ(control.TransparentColor, NO_TRANSPARENT_COLOR);
    }
    // How often it plays, low byte first, in the second block of Netscape's extension.
    const SavedImage& first = decoded.frame(0);
    ASSERT_GE(first.ExtensionBlockCount, 2);
    ASSERT_EQ(first.ExtensionBlocks[1].ByteCount, 3);
    EXPECT_EQ(first.ExtensionBlocks[1].Bytes[1], 3);
}

TEST(Gif, ColorsAreWithinAStepAndRightOnAverage) {
    const Image frame = constant(100, 30, 220);
    const auto file = need(write_gif({frame, ramp(16, 16, 3, 5)}));
    const Decoded decoded(file);
    ASSERT_NE(decoded.gif(), nullptr);
    double sums[3] = {};
    const Image second = ramp(16, 16, 3, 5);
    for (std::size_t p = 0; p < 256; ++p) {
        const GifColorType c = decoded.color(0, p);
        sums[0] += c.Red;
        sums[1] += c.Green;
        sums[2] += c.Blue;
        const GifColorType moving = decoded.color(1, p);
        EXPECT_NEAR(moving.Red, second.samples[3 * p], 51);
        EXPECT_NEAR(moving.Green, second.samples[3 * p + 1], 43);
        EXPECT_NEAR(moving.Blue, second.samples[3 * p + 2], 51);
    }
    // Each of the 64 thresholds occurs four times: the mean is within half a 64th of a step.
    EXPECT_NEAR(sums[0] / 256, 100, 1);
    EXPECT_NEAR(sums[1] / 256, 30, 1);
    EXPECT_NEAR(sums[2] / 256, 220, 1);
}

TEST(Gif, BlackAndWhiteStay) {
    const auto file = need(write_gif({constant(0, 0, 0), constant(255, 255, 255)}));
    const Decoded decoded(file);
    ASSERT_NE(decoded.gif(), nullptr);
    for (std::size_t p = 0; p < 256; ++p) {
        EXPECT_EQ(decoded.color(0, p).Red + decoded.color(0, p).Green + decoded.color(0, p).Blue,
                  0);
        EXPECT_EQ(decoded.color(1, p).Red + decoded.color(1, p).Green + decoded.color(1, p).Blue,
                  765);
    }
}

TEST(Gif, RefusesAlphaAndFramesThatDiffer) {
    EXPECT_ERROR(write_gif({ramp(4, 4, 4, 0)}), Code::kUnsupported, "no alpha");
    EXPECT_ERROR(write_gif({}), Code::kInvalidArgument, "no frame");
    EXPECT_ERROR(write_gif({ramp(4, 4, 3, 0), ramp(4, 5, 3, 0)}), Code::kInvalidArgument,
                 "4 x 5 x 3");
    EXPECT_ERROR(write_gif({Image{65536, 1, 1, 8, std::vector<std::uint16_t>(65536)}}),
                 Code::kUnsupported, "65536 x 1");
}

}  // namespace
}  // namespace splat::io
