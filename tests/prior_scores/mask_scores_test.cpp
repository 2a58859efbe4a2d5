#include "prior_scores/mask_scores.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/expect_status.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

using prior_scores::compare_masks;

TEST(GoldenNetMaskScores, ThePublishedOnes) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const auto scores = compare_masks(golden.floats("mask.pred"), golden.floats("mask.gt"));
        ASSERT_OK(scores.status());
        const std::vector<double> expected = golden.doubles("mask.result");
        // The file's mean was summed in float32.
        EXPECT_NEAR(scores.value().mae, expected[0], 1e-8);
        EXPECT_NEAR(scores.value().iou, expected[1], 1e-8);
        EXPECT_NEAR(scores.value().f_beta, expected[2], 1e-8);
        EXPECT_NEAR(scores.value().precision, expected[3], 1e-8);
        EXPECT_NEAR(scores.value().recall, expected[4], 1e-8);
    });
}

TEST(MaskScores, CountPixels) {
    // P = 1 1 0 0 1, G = 1 0 1 0 1
    const auto scores = compare_masks(std::vector<float>{1, 0.75F, 0.5F, 0, 0.51F},
                                      std::vector<float>{1, 0, 0.25F, 0, 1});
    ASSERT_OK(scores.status());
    EXPECT_EQ(scores.value().predicted_pixels, 3U);
    EXPECT_EQ(scores.value().true_pixels, 3U);
    EXPECT_NEAR(scores.value().mae, (0 + 0.75 + 0.5 + 0 + 0.49) / 5, 1e-7);
    EXPECT_EQ(scores.value().iou, 2 / (4 + 1e-6));
    EXPECT_EQ(scores.value().precision, 2 / (3 + 1e-6));
    EXPECT_EQ(scores.value().recall, 2 / (3 + 1e-6));
    EXPECT_NEAR(scores.value().f_beta, 2.0 / 3, 1e-6);
}

TEST(MaskScores, TheThresholdDecidesOnHalfTransparentPixels) {
    const std::vector<float> p = {1, 0, 0}, alpha = {1, 0.5F, 0.25F};
    const auto any = compare_masks(p, alpha), half = compare_masks(p, alpha, 0.5);
    ASSERT_OK(any.status());
    ASSERT_OK(half.status());
    EXPECT_EQ(any.value().true_pixels, 3U);
    EXPECT_EQ(half.value().true_pixels, 1U) << "0.5 is not above 0.5";
    EXPECT_EQ(half.value().mae, 0);
}

TEST(MaskScores, ConstantMasks) {
    const std::vector<float> zeros(15, 0), ones(15, 1);
    const auto full = compare_masks(ones, ones), empty = compare_masks(zeros, zeros),
               wrong = compare_masks(ones, zeros),
               one = compare_masks(std::vector<float>{1}, std::vector<float>{1});
    ASSERT_OK(full.status());
    EXPECT_NEAR(full.value().iou, 1, 1e-6);
    EXPECT_NEAR(full.value().f_beta, 1, 1e-6);
    ASSERT_OK(empty.status());
    EXPECT_EQ(empty.value().iou, 0) << "as published";
    EXPECT_EQ(empty.value().true_pixels, 0U) << "which tells it apart";
    EXPECT_EQ(empty.value().mae, 0);
    ASSERT_OK(wrong.status());
    EXPECT_EQ(wrong.value().mae, 1);
    EXPECT_EQ(wrong.value().f_beta, 0);
    ASSERT_OK(one.status());
    EXPECT_NEAR(one.value().iou, 1, 1e-6);
}

TEST(MaskScores, RefuseWhatIsNoMask) {
    const std::vector<float> one = {1}, two = {1, 0};
    EXPECT_ERROR(compare_masks(one, two).status(), Code::kShape, "1 numbers, expected 2");
    EXPECT_ERROR(compare_masks({}, {}).status(), Code::kShape, "at least one");
    EXPECT_ERROR(compare_masks(std::vector<float>{255}, one).status(), Code::kInvalidArgument,
                 "the predicted mask is 255 at number 0, expected 0 to 1");
    EXPECT_ERROR(compare_masks(one, std::vector<float>{-1}).status(), Code::kInvalidArgument,
                 "the true mask is -1");
    const std::vector<float> nan = {std::numeric_limits<float>::quiet_NaN()};
    EXPECT_ERROR(compare_masks(nan, one).status(), Code::kInvalidArgument, "nan at number 0");
}

}  // namespace
}  // namespace splat::test
