#include "eval/image_scores.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/expect_status.h"
#include "support/golden_file.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using eval::compare_images;

TEST(ImageScores, MatchThePublishedDefinition) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_case("metric", "a", {"0", "1", "2"}, [&](const Golden& golden, const std::string& pair) {
        const std::string a = pair + ".a";
        const auto scores =
            need(compare_images(golden.floats(a), golden.floats(pair + ".b"), golden.dim(a, 0),
                                golden.dim(a, 1), golden.dim(a, 2)));
        // The window of the files' SSIM was rounded to float32.
        EXPECT_NEAR(scores.ssim, golden.doubles(pair + ".ssim64")[0], 5e-7) << pair;
        EXPECT_NEAR(scores.psnr, golden.doubles(pair + ".psnr64")[0], 1e-9) << pair;
    });
}

TEST(ImageScores, EqualImagesAreInfinitelyAlike) {
    const std::vector<float> image = normal_fill(3 * 7 * 5, 1, 0.5, 0.2);
    const auto scores = need(compare_images(image, image, 3, 7, 5));
    EXPECT_EQ(scores.squared_error, 0);
    EXPECT_EQ(scores.psnr, std::numeric_limits<double>::infinity());
    EXPECT_NEAR(scores.ssim, 1, 1e-12);
}

TEST(ImageScores, ADifferenceOfATenthIsTwentyDecibels) {
    const std::vector<float> a(3 * 16 * 16, 0.5F);
    const std::vector<float> b(3 * 16 * 16, 0.6F);
    const auto scores = need(compare_images(a, b, 3, 16, 16));
    EXPECT_NEAR(scores.psnr, 20, 1e-5) << "0.6 and 0.5 are rounded to float32";
    EXPECT_LT(scores.ssim, 1);
}

TEST(ImageScores, PixelsOutsideTheMaskDoNotCount) {
    constexpr std::size_t kPixels = std::size_t{13} * 17;
    std::vector<float> a = normal_fill(3 * kPixels, 1, 0.5, 0.2);
    const std::vector<float> b = normal_fill(3 * kPixels, 2, 0.5, 0.2);
    std::vector<std::uint8_t> valid(kPixels, 1);
    const auto whole = need(compare_images(a, b, 3, 13, 17));
    const auto all = need(compare_images(a, b, 3, 13, 17, valid));
    EXPECT_EQ(all.psnr, whole.psnr);
    EXPECT_EQ(all.ssim, whole.ssim);
    for (std::size_t i = 0; i < kPixels; i += 3) valid[i] = 0;
    const auto before = need(compare_images(a, b, 3, 13, 17, valid));
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < 3 * kPixels; ++i) {
        if (valid[i % kPixels] == 0) {
            a[i] = 7;
            continue;
        }
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        squares += d * d;
        ++count;
    }
    const auto after = need(compare_images(a, b, 3, 13, 17, valid));
    EXPECT_EQ(after.psnr, before.psnr);
    EXPECT_EQ(after.ssim, before.ssim);
    EXPECT_NEAR(after.squared_error, squares / count, 1e-12);
    EXPECT_NE(after.ssim, whole.ssim);
    EXPECT_ERROR(compare_images(a, b, 3, 13, 17, std::vector<std::uint8_t>(5, 1)), Code::kShape,
                 "a mask of 5 pixels, expected 221");
    EXPECT_ERROR(compare_images(a, b, 3, 13, 17, std::vector<std::uint8_t>(kPixels, 0)),
                 Code::kInvalidArgument, "no pixel counts");
}

TEST(ImageScores, RefusesWhatCannotBeCompared) {
    std::vector<float> a(12, 0);
    const std::vector<float> b(12, 0);
    EXPECT_ERROR(compare_images(a, b, 3, 2, 3), Code::kShape, "expected 3 x 2 x 3");
    EXPECT_ERROR(compare_images({}, {}, 0, 2, 2), Code::kShape, "none of them 0");
    a[5] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(compare_images(a, b, 3, 2, 2), Code::kInvalidArgument, "not finite, at 5");
}

}  // namespace
}  // namespace splat::test
