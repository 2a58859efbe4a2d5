#include "eval/image_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/expect_status.h"
#include "support/golden.h"
#include "support/npz.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using eval::compare_images;

TEST(ImageScores, MatchThePublishedDefinition) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    for (const std::string& path : golden_files("net", "metric")) {
        const auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        int pairs = 0;
        for (int i = 0; npz.value().has(std::to_string(i) + ".a"); ++i, ++pairs) {
            const auto get = [&](const char* name) -> const NpyArray& {
                return *npz.value().find(std::to_string(i) + "." + name).value();
            };
            const NpyArray& a = get("a");
            const auto& s = a.shape;
            ASSERT_EQ(s.size(), 3U);
            const auto scores = compare_images(
                a.f32().value(), get("b").f32().value(), static_cast<std::uint32_t>(s[0]),
                static_cast<std::uint32_t>(s[1]), static_cast<std::uint32_t>(s[2]));
            ASSERT_OK(scores.status());
            // The files' SSIM has a window that was rounded to float32.
            EXPECT_NEAR(scores.value().ssim, get("ssim64").f64().value()[0], 5e-7) << i;
            EXPECT_NEAR(scores.value().psnr, get("psnr64").f64().value()[0], 1e-9) << i;
        }
        EXPECT_GT(pairs, 0);
    }
}

TEST(ImageScores, EqualImagesAreInfinitelyAlike) {
    const std::vector<float> image = normal_fill(3 * 7 * 5, 1, 0.5, 0.2);
    const auto scores = compare_images(image, image, 3, 7, 5);
    ASSERT_OK(scores.status());
    EXPECT_EQ(scores.value().squared_error, 0);
    EXPECT_EQ(scores.value().psnr, std::numeric_limits<double>::infinity());
    EXPECT_NEAR(scores.value().ssim, 1, 1e-12);
}

TEST(ImageScores, ADifferenceOfATenthIsTwentyDecibels) {
    const std::vector<float> a(3 * 16 * 16, 0.5F);
    const std::vector<float> b(3 * 16 * 16, 0.6F);
    const auto scores = compare_images(a, b, 3, 16, 16);
    ASSERT_OK(scores.status());
    EXPECT_NEAR(scores.value().psnr, 20, 1e-5) << "0.6 and 0.5 are rounded to float32";
    EXPECT_LT(scores.value().ssim, 1);
}

TEST(ImageScores, RefusesWhatCannotBeCompared) {
    std::vector<float> a(12, 0);
    const std::vector<float> b(12, 0);
    EXPECT_ERROR(compare_images(a, b, 3, 2, 3).status(), Code::kShape, "expected 3 x 2 x 3");
    EXPECT_ERROR(compare_images({}, {}, 0, 2, 2).status(), Code::kShape, "none of them 0");
    a[5] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(compare_images(a, b, 3, 2, 2).status(), Code::kInvalidArgument,
                 "not finite, at 5");
}

}  // namespace
}  // namespace splat::test
