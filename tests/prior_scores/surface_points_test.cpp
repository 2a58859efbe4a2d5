#include "prior_scores/surface_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/camera_pose.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using prior_scores::points_of_depth;

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
