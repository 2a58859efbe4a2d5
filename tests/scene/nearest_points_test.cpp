#include "scene/nearest_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "prior_scores/sample_points.h"

namespace splat::test {
namespace {

using scene::NearestPoints;

double by_a_loop(const std::vector<scene::Vec3>& points, const scene::Vec3& from) {
    double least = std::numeric_limits<double>::infinity();
    for (const scene::Vec3& point : points)
        least = std::min(least, scene::squared_distance(point, from));
    return least;
}

TEST(NearestPoints, AreThoseOfALoop) {
    for (const std::size_t count : {1U, 2U, 8U, 9U, 10U, 17U, 100U, 3001U}) {
        const std::vector<scene::Vec3> points = random_points(count, 1);
        const NearestPoints tree(points);
        for (const scene::Vec3& from : random_points(500, 2))
            ASSERT_EQ(tree.squared_distance(from), by_a_loop(points, from)) << count;
    }
}

TEST(NearestPoints, TheNearestThreeAreThoseOfASort) {
    const std::vector<scene::Vec3> points = random_points(200, 3);
    const NearestPoints tree(points);
    for (const scene::Vec3& from : points) {
        std::vector<double> all;
        for (const scene::Vec3& point : points) all.push_back(scene::squared_distance(point, from));
        std::sort(all.begin(), all.end());
        std::vector<double> least(3);
        tree.squared_distances(from, least);
        EXPECT_TRUE(std::equal(least.begin(), least.end(), all.begin()));
    }
    std::vector<double> few(3);
    NearestPoints(std::vector<scene::Vec3>{{0, 0, 0}}).squared_distances({0, 0, 2}, few);
    EXPECT_EQ(few[0], 4);
    EXPECT_TRUE(std::isinf(few[1]) && std::isinf(few[2]));
}

TEST(NearestPoints, OfAGridWithManyEqualDistances) {
    std::vector<scene::Vec3> points;
    for (int i = 0; i < 10 * 10 * 10; ++i) {
        const scene::Vec3 point = {static_cast<double>(i % 10), static_cast<double>(i / 10 % 10),
                                   static_cast<double>(i / 100)};
        points.push_back(point);
        points.push_back(point);
    }
    const NearestPoints tree(points);
    for (const scene::Vec3& point : points) EXPECT_EQ(tree.squared_distance(point), 0);
    EXPECT_EQ(tree.squared_distance({4.5, 4.5, 4.5}), 0.75);
    EXPECT_EQ(tree.squared_distance({-1, 0, 20}), 1 + 121);
}

TEST(NearestPoints, OfOneRepeatedPoint) {
    const NearestPoints tree(std::vector<scene::Vec3>(100, {1, 2, 3}));
    EXPECT_EQ(tree.squared_distance({1, 2, 5}), 4);
}

}  // namespace
}  // namespace splat::test
