#include "prior_scores/surface_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/camera_pose.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using prior_scores::points_of_depth;
using prior_scores::sample_surface;

/// The unit square in the plane z = 2 as two triangles, and a triangle of 3 times its area at z = 5.
io::Mesh two_planes() {
    return {{{0, 0, 2}, {1, 0, 2}, {1, 1, 2}, {0, 1, 2}, {0, 0, 5}, {2, 0, 5}, {0, 3, 5}},
            {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}};
}

TEST(SurfacePoints, LieOnTheSurfaceEvenly) {
    constexpr std::size_t kCount = 40000;
    const auto points = need(sample_surface(two_planes(), kCount, 7));
    ASSERT_EQ(points.size(), kCount);
    double square = 0, quarter = 0;
    for (const scene::Vec3& point : points) {
        ASSERT_GE(point[0], 0);
        ASSERT_GE(point[1], 0);
        if (point[2] == 2) {
            square += 1;
            ASSERT_LE(std::max(point[0], point[1]), 1);
            if (point[0] < 0.5 && point[1] < 0.5) quarter += 1;
        } else {
            ASSERT_EQ(point[2], 5);
            ASSERT_LE(point[0] / 2 + point[1] / 3, 1 + 1e-12);
        }
    }
    // Four standard deviations of a binomial distribution.
    EXPECT_NEAR(square / kCount, 0.25, 4 * std::sqrt(0.25 * 0.75 / kCount));
    EXPECT_NEAR(quarter / square, 0.25, 4 * std::sqrt(0.25 * 0.75 / square));
}

TEST(SurfacePoints, TheSeedAndThePlaceDecide) {
    const auto a = need(sample_surface(two_planes(), 100, 7)),
               longer = need(sample_surface(two_planes(), 200, 7)),
               other = need(sample_surface(two_planes(), 100, 8));
    EXPECT_TRUE(std::equal(a.begin(), a.end(), longer.begin()));
    EXPECT_NE(a, other);
}

TEST(SurfacePoints, TrianglesWithoutAreaGetNone) {
    io::Mesh mesh = two_planes();
    mesh.vertices.push_back({9, 9, 9});
    mesh.triangles = {{7, 7, 7}, {0, 1, 2}, {7, 7, 0}};
    const auto points = need(sample_surface(mesh, 1000, 1));
    for (const scene::Vec3& point : points) EXPECT_EQ(point[2], 2);
    mesh.triangles = {{7, 7, 7}};
    EXPECT_ERROR(sample_surface(mesh, 1, 1), Code::kInvalidArgument, "an area of 0");
    EXPECT_ERROR(sample_surface({}, 1, 1), Code::kInvalidArgument, "no faces");
    mesh.vertices[7] = {1e300, 1e300, 0};
    mesh.triangles = {{0, 1, 7}, {1, 2, 7}};
    EXPECT_ERROR(sample_surface(mesh, 1, 1), Code::kInvalidArgument, "expected more than 0");
}

TEST(DepthPoints, AreWhereTheCameraSeesThem) {
    auto made = need(scene::camera_from_fov(3, 2, 1.0));
    scene::Camera camera = made;
    const auto pose = need(scene::look_at({4, -1, 2}, {0, 0.5, 0}, scene::kUp));
    camera.world_to_camera = pose;
    const auto points = need(points_of_depth(std::vector<float>{1, 2, 0, 4, -1, 8}, camera));
    const double depths[] = {1, 2, 4, 8};
    const double columns[] = {0, 1, 0, 2}, rows[] = {0, 0, 1, 1};
    ASSERT_EQ(points.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
        const scene::Vec3 seen = scene::rotation_of(camera.world_to_camera) * points[i] +
                                 scene::translation_of(camera.world_to_camera);
        EXPECT_NEAR(seen[2], depths[i], 1e-12);
        EXPECT_NEAR(camera.fx * seen[0] / seen[2] + camera.cx, columns[i] + 0.5, 1e-12);
        EXPECT_NEAR(camera.fy * seen[1] / seen[2] + camera.cy, rows[i] + 0.5, 1e-12);
    }
}

TEST(DepthPoints, RefuseWhatIsNoDepth) {
    auto camera = need(scene::camera_from_fov(2, 1, 1.0));
    EXPECT_ERROR(points_of_depth(std::vector<float>{1}, camera), Code::kShape,
                 "1 numbers, expected 2");
    const std::vector<float> infinite = {1, std::numeric_limits<float>::infinity()};
    EXPECT_ERROR(points_of_depth(infinite, camera), Code::kInvalidArgument, "inf at number 1");
}

}  // namespace
}  // namespace splat::test
