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
        const auto scores =
            need(compare_masks(golden.floats("mask.pred"), golden.floats("mask.gt")));
        const std::vector<double> expected = golden.doubles("mask.result");
        // The file's mean was summed in float32.
        EXPECT_NEAR(scores.mae, expected[0], 1e-8);
        EXPECT_NEAR(scores.iou, expected[1], 1e-8);
        EXPECT_NEAR(scores.f_beta, expected[2], 1e-8);
        EXPECT_NEAR(scores.precision, expected[3], 1e-8);
        EXPECT_NEAR(scores.recall, expected[4], 1e-8);
    });
}

TEST(MaskScores, CountPixels) {
    // P = 1 1 0 0 1, G = 1 0 1 0 1
    const auto scores = need(compare_masks(std::vector<float>{1, 0.75F, 0.5F, 0, 0.51F},
                                           std::vector<float>{1, 0, 0.25F, 0, 1}));
    EXPECT_EQ(scores.predicted_pixels, 3U);
    EXPECT_EQ(scores.true_pixels, 3U);
    EXPECT_NEAR(scores.mae, (0 + 0.75 + 0.5 + 0 + 0.49) / 5, 1e-7);
    EXPECT_EQ(scores.iou, 2 / (4 + 1e-6));
    EXPECT_EQ(scores.precision, 2 / (3 + 1e-6));
    EXPECT_EQ(scores.recall, 2 / (3 + 1e-6));
    EXPECT_NEAR(scores.f_beta, 2.0 / 3, 1e-6);
}

TEST(MaskScores, TheThresholdDecidesOnHalfTransparentPixels) {
    const std::vector<float> p = {1, 0, 0}, alpha = {1, 0.5F, 0.25F};
    const auto any = need(compare_masks(p, alpha)), half = need(compare_masks(p, alpha, 0.5));
    EXPECT_EQ(any.true_pixels, 3U);
    EXPECT_EQ(half.true_pixels, 1U) << "0.5 is not above 0.5";
    EXPECT_EQ(half.mae, 0);
}

TEST(MaskScores, ConstantMasks) {
    const std::vector<float> zeros(15, 0), ones(15, 1);
    const auto full = need(compare_masks(ones, ones)), empty = need(compare_masks(zeros, zeros)),
               wrong = need(compare_masks(ones, zeros)),
               one = need(compare_masks(std::vector<float>{1}, std::vector<float>{1}));
    EXPECT_NEAR(full.iou, 1, 1e-6);
    EXPECT_NEAR(full.f_beta, 1, 1e-6);
    EXPECT_EQ(empty.iou, 0) << "as published";
    EXPECT_EQ(empty.true_pixels, 0U) << "which tells it apart";
    EXPECT_EQ(empty.mae, 0);
    EXPECT_EQ(wrong.mae, 1);
    EXPECT_EQ(wrong.f_beta, 0);
    EXPECT_NEAR(one.iou, 1, 1e-6);
}

TEST(MaskScores, RefuseWhatIsNoMask) {
    const std::vector<float> one = {1}, two = {1, 0};
    EXPECT_ERROR(compare_masks(one, two), Code::kShape, "1 numbers, expected 2");
    EXPECT_ERROR(compare_masks({}, {}), Code::kShape, "at least one");
    EXPECT_ERROR(compare_masks(std::vector<float>{255}, one), Code::kInvalidArgument,
                 "the predicted mask is 255 at number 0, expected 0 to 1");
    EXPECT_ERROR(compare_masks(one, std::vector<float>{-1}), Code::kInvalidArgument,
                 "the true mask is -1");
    const std::vector<float> nan = {std::numeric_limits<float>::quiet_NaN()};
    EXPECT_ERROR(compare_masks(nan, one), Code::kInvalidArgument, "nan at number 0");
}

}  // namespace
}  // namespace splat::test
