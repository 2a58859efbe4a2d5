#include "prior_scores/plane_scores.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/expect_status.h"

namespace splat::test {
namespace {

using prior_scores::compare_planes;

/// A map of pixels on these planes: 0 none, else number k faces along z at the distance k.
std::vector<float> facing(const std::vector<int>& ids) {
    std::vector<float> map;
    for (const int id : ids)
        map.insert(map.end(), {0, 0, id == 0 ? 0.0F : -1.0F, static_cast<float>(id)});
    return map;
}

TEST(PlaneScores, CoveringAndRecallByHand) {
    // Plane 1: 4 pixels, of which 3 are found with one more: IoU 3/5. Plane 2: 2 pixels, one of them: IoU 1/2.
    const auto scores =
        need(compare_planes(facing({1, 1, 1, 0, 1, 2, 0}), facing({1, 1, 1, 1, 0, 2, 2}), 0, 0));
    EXPECT_NEAR(scores.covering, (4 * 0.6 + 2 * 0.5) / 6, 1e-15);
    EXPECT_EQ(scores.recall, 0.5) << "an IoU of 0.5 is not above it";
    EXPECT_EQ(scores.precision, 0.5);
    EXPECT_EQ(scores.pixels, 6U);
    EXPECT_EQ(scores.predicted, 2U);
    EXPECT_EQ(scores.truth, 2U);
}

TEST(PlaneScores, NoPredictionScoresNothing) {
    const auto scores = need(compare_planes(facing({0, 0}), facing({1, 2}), 1, 10));
    EXPECT_EQ(scores.covering, 0);
    EXPECT_EQ(scores.recall, 0);
    EXPECT_EQ(scores.precision, 0);
}

TEST(PlaneScores, DistanceAndAngleDecide) {
    const std::vector<float> truth = {0, 0, -1, 2}, moved = {0, 0, -1, 2.25F},
                             turned = {0, 0.1F, -1, 2};  // 5.7 degrees
    EXPECT_EQ(need(compare_planes(moved, truth, 0.25, 10)).recall, 1);
    EXPECT_EQ(need(compare_planes(moved, truth, 0.24, 10)).recall, 0);
    EXPECT_EQ(need(compare_planes(turned, truth, 0.05, 6)).recall, 1);
    EXPECT_EQ(need(compare_planes(turned, truth, 0.05, 5)).recall, 0);
    EXPECT_EQ(need(compare_planes(turned, truth, 0.05, 5)).covering, 1) << "of the pixels alone";
}

TEST(PlaneScores, RefuseWhatCannotBeCompared) {
    const auto one = facing({1}), two = facing({1, 2});
    EXPECT_ERROR(compare_planes(one, two, 0, 0), Code::kShape, "4 numbers, expected 8");
    EXPECT_ERROR(compare_planes(one, std::vector<float>(3), 0, 0), Code::kShape, "3 numbers");
    EXPECT_ERROR(compare_planes({}, {}, 0, 0), Code::kShape, "at least one");
    EXPECT_ERROR(compare_planes(one, facing({0}), 0, 0), Code::kInvalidArgument, "no plane");
    EXPECT_ERROR(compare_planes(std::vector<float>{0, 0, 0, 1}, one, 0, 0), Code::kInvalidArgument,
                 "no normal");
    const std::vector<float> infinite = {0, 0, std::numeric_limits<float>::infinity(), 1};
    EXPECT_ERROR(compare_planes(infinite, one, 0, 0), Code::kInvalidArgument, "inf at number 2");
    EXPECT_ERROR(compare_planes(one, one, -1, 0), Code::kInvalidArgument, "distance");
    EXPECT_ERROR(compare_planes(one, one, 0, 181), Code::kInvalidArgument, "181 degrees");
}

}  // namespace
}  // namespace splat::test
