#include "prior_scores/point_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "prior_scores/sample_points.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using prior_scores::compare_points;
using Points = std::vector<scene::Vec3>;

TEST(PointScores, OfPointsOnALine) {
    // Distances of the predicted ones 0, 1; of the true ones 0, 3.
    const auto scores =
        compare_points(Points{{0, 0, 0}, {1, 0, 0}}, Points{{0, 0, 0}, {0, 3, 0}}, 1.5);
    ASSERT_OK(scores.status());
    EXPECT_EQ(scores.value().accuracy, 0.5);
    EXPECT_EQ(scores.value().completeness, 1.5);
    EXPECT_EQ(scores.value().chamfer, 1);
    EXPECT_EQ(scores.value().chamfer_squared, 0.5 + 4.5);
    EXPECT_EQ(scores.value().precision, 1);
    EXPECT_EQ(scores.value().recall, 0.5);
    EXPECT_EQ(scores.value().f_score, 2.0 / 3);
}

TEST(PointScores, EqualSetsArePerfectAndFarOnesWorthless) {
    const Points points = random_points(10000, 3);
    const auto same = compare_points(points, points, 1e-9);
    ASSERT_OK(same.status());
    EXPECT_EQ(same.value().chamfer, 0);
    EXPECT_EQ(same.value().f_score, 1);
    Points far = points;
    for (scene::Vec3& point : far) point[0] += 1000;
    const auto none = compare_points(far, points, 1);
    ASSERT_OK(none.status());
    EXPECT_EQ(none.value().f_score, 0);
    EXPECT_GT(none.value().accuracy, 990);
}

TEST(PointScores, TheThresholdItselfIsOutside) {
    const auto scores = compare_points(Points{{0, 0, 0}}, Points{{0, 0, 2}}, 2);
    ASSERT_OK(scores.status());
    EXPECT_EQ(scores.value().f_score, 0);
}

TEST(PointScores, SwappedSetsSwapTheDirections) {
    const Points a = random_points(5000, 4), b = random_points(3000, 5);
    const auto ab = compare_points(a, b, 0.05), ba = compare_points(b, a, 0.05);
    ASSERT_OK(ab.status());
    ASSERT_OK(ba.status());
    EXPECT_EQ(ab.value().accuracy, ba.value().completeness);
    EXPECT_EQ(ab.value().precision, ba.value().recall);
    EXPECT_EQ(ab.value().chamfer, ba.value().chamfer);
    EXPECT_GT(ab.value().precision, 0);
    EXPECT_LT(ab.value().precision, 1);
}

TEST(PointScores, RefuseWhatCannotBeCompared) {
    const Points one = {{0, 0, 0}};
    EXPECT_ERROR(compare_points({}, one, 1).status(), Code::kInvalidArgument,
                 "no predicted points");
    EXPECT_ERROR(compare_points(one, {}, 1).status(), Code::kInvalidArgument, "no true points");
    for (const double threshold : {0.0, -1.0, std::nan(""), HUGE_VAL})
        EXPECT_ERROR(compare_points(one, one, threshold).status(), Code::kInvalidArgument,
                     "the threshold is");
    EXPECT_ERROR(compare_points(one, Points{{0, 0, 0}, {0, std::nan(""), 0}}, 1).status(),
                 Code::kInvalidArgument, "true point 1 is not finite");
}

}  // namespace
}  // namespace splat::test
