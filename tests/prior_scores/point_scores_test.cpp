#include "prior_scores/point_scores.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prior_scores/sample_points.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using prior_scores::compare_points;
using Points = std::vector<scene::Vec3>;

TEST(PointScores, OfPointsOnALine) {
    // Distances of the predicted ones 0, 1; of the true ones 0, 3.
    const auto scores =
        need(compare_points(Points{{0, 0, 0}, {1, 0, 0}}, Points{{0, 0, 0}, {0, 3, 0}}, 1.5));
    EXPECT_EQ(scores.accuracy, 0.5);
    EXPECT_EQ(scores.completeness, 1.5);
    EXPECT_EQ(scores.chamfer, 1);
    EXPECT_EQ(scores.chamfer_squared, 0.5 + 4.5);
    EXPECT_EQ(scores.precision, 1);
    EXPECT_EQ(scores.recall, 0.5);
    EXPECT_EQ(scores.f_score, 2.0 / 3);
}

TEST(PointScores, EqualSetsArePerfectAndFarOnesWorthless) {
    const Points points = random_points(10000, 3);
    const auto same = need(compare_points(points, points, 1e-9));
    EXPECT_EQ(same.chamfer, 0);
    EXPECT_EQ(same.f_score, 1);
    Points far = points;
    for (scene::Vec3& point : far) point[0] += 1000;
    const auto none = need(compare_points(far, points, 1));
    EXPECT_EQ(none.f_score, 0);
    EXPECT_GT(none.accuracy, 990);
}

TEST(PointScores, TheThresholdItselfIsOutside) {
    EXPECT_EQ(need(compare_points(Points{{0, 0, 0}}, Points{{0, 0, 2}}, 2)).f_score, 0);
}

TEST(PointScores, SwappedSetsSwapTheDirections) {
    const Points a = random_points(5000, 4), b = random_points(3000, 5);
    const auto ab = need(compare_points(a, b, 0.05)), ba = need(compare_points(b, a, 0.05));
    EXPECT_EQ(ab.accuracy, ba.completeness);
    EXPECT_EQ(ab.precision, ba.recall);
    EXPECT_EQ(ab.chamfer, ba.chamfer);
    EXPECT_GT(ab.precision, 0);
    EXPECT_LT(ab.precision, 1);
}

TEST(PointScores, RefuseWhatCannotBeCompared) {
    const Points one = {{0, 0, 0}};
    EXPECT_ERROR(compare_points({}, one, 1), Code::kInvalidArgument, "no predicted points");
    EXPECT_ERROR(compare_points(one, {}, 1), Code::kInvalidArgument, "no true points");
    for (const double threshold : {0.0, -1.0, std::nan(""), HUGE_VAL})
        EXPECT_ERROR(compare_points(one, one, threshold), Code::kInvalidArgument,
                     "the threshold is");
    EXPECT_ERROR(compare_points(one, Points{{0, 0, 0}, {0, std::nan(""), 0}}, 1),
                 Code::kInvalidArgument, "true point 1 is not finite");
}

}  // namespace
}  // namespace splat::test
