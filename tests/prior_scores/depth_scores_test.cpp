#include "prior_scores/depth_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/expect_status.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

using prior_scores::compare_depth;
using prior_scores::DepthRule;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(GoldenNetDepthScores, ThePublishedOnes) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const auto scores = need(compare_depth(golden.floats("dm.pred"), golden.floats("dm.gt"), {},
                                               DepthRule::kPublished));
        const std::vector<double> expected = golden.doubles("dm.result");
        // The file's alignment was rounded to float32.
        const auto near = [](double value) { return 1e-6 * std::abs(value); };
        EXPECT_NEAR(scores.si_rmse, expected[0], near(expected[0]));
        EXPECT_NEAR(scores.abs_rel, expected[1], near(expected[1]));
        EXPECT_NEAR(scores.rmse, expected[2], near(expected[2]));
        EXPECT_EQ(scores.within[0], expected[3]);
        EXPECT_NEAR(scores.scale, expected[4], near(expected[4]));
        EXPECT_NEAR(scores.shift, expected[5], near(expected[5]));
        EXPECT_EQ(scores.pixels, golden.floats("dm.gt").size());
    });
}

TEST(GoldenNetDepthScores, OtherwiseANegativeDepthIsWithinNoFactor) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const std::vector<float> p = golden.floats("dm.pred"), g = golden.floats("dm.gt");
        const auto published = need(compare_depth(p, g, {}, DepthRule::kPublished));
        const auto valid = need(compare_depth(p, g));
        std::size_t negative = 0;
        for (const float value : p)
            if (valid.scale * static_cast<double>(value) + valid.shift <= 0) ++negative;
        EXPECT_GT(negative, 0U) << "the file shows no difference between the rules";
        EXPECT_NEAR(
            valid.within[0],
            published.within[0] - static_cast<double>(negative) / static_cast<double>(p.size()),
            1e-12);
        EXPECT_EQ(valid.rmse, published.rmse) << "every true depth is > 0";
    });
}

TEST(DepthScores, AnAffinePredictionIsPerfect) {
    std::vector<float> p, g;
    for (int i = 0; i < 7 * 5; ++i) {
        g.push_back(1 + static_cast<float>(i));
        p.push_back(g.back() * -0.25F + 3);  // exact in float32
    }
    const auto scores = need(compare_depth(p, g));
    EXPECT_NEAR(scores.scale, -4, 1e-12);
    EXPECT_NEAR(scores.shift, 12, 1e-12);
    EXPECT_NEAR(scores.abs_rel, 0, 1e-12);
    EXPECT_NEAR(scores.rmse, 0, 1e-12);
    EXPECT_NEAR(scores.si_rmse, 0, 1e-6) << "the root of a rounded 0";
    for (const double share : scores.within) EXPECT_EQ(share, 1);
}

TEST(DepthScores, AConstantPredictionIsTheMean) {
    // |p - g| / g: 1/1, 0/2, 1/3; p/g or g/p: 2, 1, 1.5
    const auto scores =
        need(compare_depth(std::vector<float>{5, 5, 5}, std::vector<float>{1, 2, 3}));
    EXPECT_EQ(scores.scale, 0);
    EXPECT_EQ(scores.shift, 2);
    EXPECT_NEAR(scores.abs_rel, 4.0 / 9, 1e-15);
    EXPECT_NEAR(scores.rmse, std::sqrt(2.0 / 3), 1e-15);
    EXPECT_NEAR(scores.within[0], 1.0 / 3, 1e-15);
    EXPECT_NEAR(scores.within[1], 2.0 / 3, 1e-15) << "1.5 is below 1.5625";
    EXPECT_NEAR(scores.within[2], 2.0 / 3, 1e-15) << "2 is above 1.953";
    const double a = std::log(2.0), b = std::log(2.0 / 3), mean = (a + b) / 3;
    EXPECT_NEAR(scores.si_rmse, std::sqrt((a * a + b * b) / 3 - mean * mean), 1e-15);
}

TEST(DepthScores, OnePixelIsPerfect) {
    const auto scores = need(compare_depth(std::vector<float>{7}, std::vector<float>{3}));
    EXPECT_EQ(scores.rmse, 0);
    EXPECT_EQ(scores.pixels, 1U);
}

TEST(DepthScores, ANegativeDepthIsWithinNoFactor) {
    // Aligned: -0.72, 1.73, 4.18; only the last is within 1.25 of its truth.
    const std::vector<float> p = {0, 1, 2}, g = {0.1F, 0.1F, 5};
    const auto valid = need(compare_depth(p, g)),
               published = need(compare_depth(p, g, {}, DepthRule::kPublished));
    EXPECT_NEAR(valid.within[0], 1.0 / 3, 1e-15);
    EXPECT_NEAR(valid.within[2], 1.0 / 3, 1e-15);
    EXPECT_NEAR(published.within[0], 2.0 / 3, 1e-15);
}

TEST(DepthScores, OnlyAsPublishedDoesAPixelWithoutDepthCount) {
    const std::vector<float> p = {1, 2, 3, 4}, g = {2, 4, 6, 0};
    const auto valid = need(compare_depth(p, g));
    EXPECT_EQ(valid.pixels, 3U);
    EXPECT_NEAR(valid.rmse, 0, 1e-12);
    const auto published = need(compare_depth(p, g, {}, DepthRule::kPublished));
    EXPECT_EQ(published.pixels, 4U);
    EXPECT_GT(published.abs_rel, 1e6) << "an error divided by 1e-8";
}

TEST(DepthScores, AMaskHidesWhatIsNotFinite) {
    const std::vector<float> p = {1, 2, kNan, 4}, g = {2, 4, 6, kNan};
    EXPECT_ERROR(compare_depth(p, g), Code::kInvalidArgument,
                 "nan at number 2, expected finite numbers; leave such pixels out");
    EXPECT_EQ(need(compare_depth(p, g, std::vector<float>{1, 0.75F, 0.5F, 0})).pixels, 2U);
    EXPECT_ERROR(compare_depth(p, g, std::vector<float>{1, 1, 1, 0}), Code::kInvalidArgument,
                 "at number 2, the prediction is nan and the truth 6");
}

TEST(DepthScores, RefusesWhatCannotBeCompared) {
    const std::vector<float> two = {1, 2}, three = {1, 2, 3}, zeros = {0, 0};
    EXPECT_ERROR(compare_depth(two, three), Code::kShape, "2 numbers, the true one 3");
    EXPECT_ERROR(compare_depth(two, two, three), Code::kShape, "the mask 3");
    EXPECT_ERROR(compare_depth({}, {}), Code::kShape, "at least one");
    EXPECT_ERROR(compare_depth(two, zeros), Code::kInvalidArgument, "nowhere > 0");
    EXPECT_ERROR(compare_depth(two, two, zeros), Code::kInvalidArgument, "nowhere > 0.5");
    EXPECT_ERROR(compare_depth(two, zeros, two), Code::kInvalidArgument, "a truth > 0");
    EXPECT_ERROR(compare_depth(two, two, two, DepthRule::kPublished), Code::kInvalidArgument,
                 "as published every pixel counts");
}

}  // namespace
}  // namespace splat::test
