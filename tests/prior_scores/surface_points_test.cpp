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
    const auto points = sample_surface(two_planes(), kCount, 7);
    ASSERT_OK(points.status());
    ASSERT_EQ(points.value().size(), kCount);
    double square = 0, quarter = 0;
    for (const scene::Vec3& point : points.value()) {
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
    const auto a = sample_surface(two_planes(), 100, 7),
               longer = sample_surface(two_planes(), 200, 7),
               other = sample_surface(two_planes(), 100, 8);
    ASSERT_OK(a.status());
    ASSERT_OK(longer.status());
    ASSERT_OK(other.status());
    EXPECT_TRUE(std::equal(a.value().begin(), a.value().end(), longer.value().begin()));
    EXPECT_NE(a.value(), other.value());
}

TEST(SurfacePoints, TrianglesWithoutAreaGetNone) {
    io::Mesh mesh = two_planes();
    mesh.vertices.push_back({9, 9, 9});
    mesh.triangles = {{7, 7, 7}, {0, 1, 2}, {7, 7, 0}};
    const auto points = sample_surface(mesh, 1000, 1);
    ASSERT_OK(points.status());
    for (const scene::Vec3& point : points.value()) EXPECT_EQ(point[2], 2);
    mesh.triangles = {{7, 7, 7}};
    EXPECT_ERROR(sample_surface(mesh, 1, 1).status(), Code::kInvalidArgument, "an area of 0");
    EXPECT_ERROR(sample_surface({}, 1, 1).status(), Code::kInvalidArgument, "no faces");
    mesh.vertices[7] = {1e300, 1e300, 0};
    mesh.triangles = {{0, 1, 7}, {1, 2, 7}};
    EXPECT_ERROR(sample_surface(mesh, 1, 1).status(), Code::kInvalidArgument,
                 "expected more than 0");
}

TEST(DepthPoints, AreWhereTheCameraSeesThem) {
    auto made = scene::camera_from_fov(3, 2, 1.0);
    ASSERT_OK(made.status());
    scene::Camera camera = made.value();
    const auto pose = scene::look_at({4, -1, 2}, {0, 0.5, 0}, scene::kUp);
    ASSERT_OK(pose.status());
    camera.world_to_camera = pose.value();
    const auto points = points_of_depth(std::vector<float>{1, 2, 0, 4, -1, 8}, camera);
    ASSERT_OK(points.status());
    const double depths[] = {1, 2, 4, 8};
    const double columns[] = {0, 1, 0, 2}, rows[] = {0, 0, 1, 1};
    ASSERT_EQ(points.value().size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
        const scene::Vec3 seen = scene::rotation_of(camera.world_to_camera) * points.value()[i] +
                                 scene::translation_of(camera.world_to_camera);
        EXPECT_NEAR(seen[2], depths[i], 1e-12);
        EXPECT_NEAR(camera.fx * seen[0] / seen[2] + camera.cx, columns[i] + 0.5, 1e-12);
        EXPECT_NEAR(camera.fy * seen[1] / seen[2] + camera.cy, rows[i] + 0.5, 1e-12);
    }
}

TEST(DepthPoints, RefuseWhatIsNoDepth) {
    auto camera = scene::camera_from_fov(2, 1, 1.0);
    ASSERT_OK(camera.status());
    EXPECT_ERROR(points_of_depth(std::vector<float>{1}, camera.value()).status(), Code::kShape,
                 "1 numbers, expected 2");
    const std::vector<float> infinite = {1, std::numeric_limits<float>::infinity()};
    EXPECT_ERROR(points_of_depth(infinite, camera.value()).status(), Code::kInvalidArgument,
                 "inf at number 1");
}

}  // namespace
}  // namespace splat::test
