#include "prior_scores/normal_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "support/expect_status.h"

namespace splat::test {
namespace {

using prior_scores::compare_normals;

/// Normals in the plane of x and z, at these angles from z, as [3, pixels].
std::vector<float> turned(const std::vector<double>& degrees) {
    std::vector<float> map;
    for (const double angle : degrees)
        map.push_back(static_cast<float>(std::sin(angle * std::numbers::pi / 180)));
    map.resize(2 * degrees.size(), 0);
    for (const double angle : degrees)
        map.push_back(static_cast<float>(std::cos(angle * std::numbers::pi / 180)));
    return map;
}

constexpr double kRounding = 1e-5;  ///< degrees; of normals in float32

TEST(NormalScores, AreStatisticsOfTheAngles) {
    const std::vector<double> angles = {5, 11, 20, 29, 90};
    const auto scores =
        need(compare_normals(turned(angles), turned(std::vector<double>(angles.size(), 0))));
    EXPECT_NEAR(scores.mean, 31, kRounding);
    EXPECT_NEAR(scores.median, 20, kRounding);
    EXPECT_NEAR(scores.rmse, std::sqrt((25 + 121 + 400 + 841 + 8100) / 5.0), kRounding);
    EXPECT_EQ(scores.within[0], 0.4);
    EXPECT_EQ(scores.within[1], 0.6);
    EXPECT_EQ(scores.within[2], 0.8);
    EXPECT_EQ(scores.pixels, 5U);
    EXPECT_EQ(scores.missing, 0U);
}

TEST(NormalScores, MedianOfAnEvenCount) {
    const auto scores = need(compare_normals(turned({40, 10, 30, 20}), turned({0, 0, 0, 0})));
    EXPECT_NEAR(scores.median, 25, kRounding);
}

TEST(NormalScores, ASmallAngleIsNotRoundedAway) {
    EXPECT_NEAR(need(compare_normals(turned({0.001}), turned({0}))).mean, 0.001, 1e-9);
}

TEST(NormalScores, LengthsDoNotMatter) {
    const auto scores =
        need(compare_normals(std::vector<float>{0, 3, 0}, std::vector<float>{0, 0, -0.75F}));
    EXPECT_NEAR(scores.mean, 90, kRounding);
}

TEST(NormalScores, PixelsWithoutATrueNormalAreLeftOutAndMissingOnesAreWrong) {
    const std::vector<float> truth = {0, 1, 0, /**/ 0, 0, 0, /**/ 0, 0, 1};
    const std::vector<float> prediction = {0, 0, 0, /**/ 0, 0, 0, /**/ 1, 0.004F, 1};
    const auto scores = need(compare_normals(prediction, truth));
    EXPECT_EQ(scores.pixels, 2U);
    EXPECT_EQ(scores.missing, 1U);
    EXPECT_NEAR(scores.mean, 90, kRounding) << "180 and 0 degrees";
}

TEST(NormalScores, AMaskSaysWhatCounts) {
    std::vector<float> truth = turned({0, 0, 0});
    const std::vector<float> prediction = turned({10, 20, 30});
    truth[2] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(compare_normals(prediction, truth), Code::kInvalidArgument,
                 "pixel 2 is not finite");
    const auto scores = need(compare_normals(prediction, truth, std::vector<float>{0, 1, 0}));
    EXPECT_NEAR(scores.mean, 20, kRounding);
    EXPECT_EQ(scores.pixels, 1U);
}

TEST(NormalScores, RefuseWhatCannotBeCompared) {
    const std::vector<float> one = turned({0}), two = turned({0, 0}), none(3, 0);
    EXPECT_ERROR(compare_normals(one, two), Code::kShape, "3 numbers, the true ones 6");
    EXPECT_ERROR(compare_normals(one, one, two), Code::kShape, "the mask 6");
    EXPECT_ERROR(compare_normals({}, {}), Code::kInvalidArgument, "no true normal");
    EXPECT_ERROR(compare_normals(one, none), Code::kInvalidArgument, "no true normal");
    EXPECT_ERROR(compare_normals(one, none, std::vector<float>{1}), Code::kInvalidArgument,
                 "has the length 0");
    EXPECT_ERROR(compare_normals(one, one, std::vector<float>{0}), Code::kInvalidArgument,
                 "nowhere > 0.5");
}

}  // namespace
}  // namespace splat::test
