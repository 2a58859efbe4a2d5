#include "scene/camera_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "scene/camera_pose.h"
#include "support/expect_status.h"

namespace splat::scene {
namespace {

Camera at(const Vec3& eye, const Vec3& target) {
    Camera camera = camera_from_fov(40, 30, 1).value();
    camera.world_to_camera = look_at(eye, target, kUp).value();
    return camera;
}

/// Cameras around the origin that look at it.
std::vector<Camera> ring(std::size_t count, double share = 1) {
    std::vector<Camera> cameras;
    for (std::size_t i = 0; i < count; ++i) {
        const double angle =
            share * 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
        cameras.push_back(at({3 * std::sin(angle), -0.5, -3 * std::cos(angle)}, {}));
    }
    return cameras;
}

double difference(const Camera& a, const Camera& b) {
    double most = 0;
    for (std::size_t i = 0; i < 16; ++i)
        most = std::max(most, std::abs(a.world_to_camera[i] - b.world_to_camera[i]));
    return most;
}

/// The largest distance between neighbouring frames over the smallest one.
double unevenness(const std::vector<Camera>& path) {
    double least = INFINITY, most = 0;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        const double step = glm::length(camera_center(path[i + 1]) - camera_center(path[i]));
        least = std::min(least, step);
        most = std::max(most, step);
    }
    return most / least;
}

TEST(CameraPath, ClosedPathGoesThroughItsKeys) {
    const std::vector<Camera> keys = ring(12);
    const std::vector<Camera> path = camera_path(keys, 48, true).value();
    ASSERT_EQ(path.size(), 48U);
    for (std::size_t i = 0; i < path.size(); ++i) {
        if (i % 4 == 0) {
            EXPECT_LT(difference(path[i], keys[i / 4]), 1e-9) << i;
        }
        EXPECT_OK(check_camera(path[i]));
        EXPECT_EQ(path[i].fx, keys[0].fx);
        const Vec3 center = camera_center(path[i]);
        EXPECT_NEAR(std::hypot(center.x, center.z), 3, 0.01) << i;
        // It looks at the origin between keys, too.
        const Vec3 seen = translation_of(path[i].world_to_camera);
        EXPECT_LT(std::hypot(seen.x, seen.y), 0.02) << i;
    }
    EXPECT_LT(difference(path[47], path[0]), 0.5);
    EXPECT_LT(unevenness(path), 1.1);
}

TEST(CameraPath, OpenPathEndsAtItsLastKey) {
    std::vector<Camera> keys = ring(7, 0.5);
    keys.insert(keys.begin() + 3, keys[3]);  // an equal pose takes no time
    const std::vector<Camera> path = camera_path(keys, 60, false).value();
    EXPECT_LT(difference(path.front(), keys.front()), 1e-9);
    EXPECT_LT(difference(path.back(), keys.back()), 1e-9);
    EXPECT_LT(unevenness(path), 1.1);
    EXPECT_EQ(camera_path(keys, 1, false).value().size(), 1U);
    EXPECT_TRUE(camera_path(keys, 0, false).value().empty());
}

TEST(CameraPath, UnequalGapsAndTurnsOnTheSpot) {
    // A straight line with gaps of 1, 3 and 1: equal steps.
    std::vector<Camera> keys;
    for (const double x : {0.0, 1.0, 4.0, 5.0}) keys.push_back(at({x, 0, 0}, {x, 0, 1}));
    const std::vector<Camera> line = camera_path(keys, 11, false).value();
    for (std::size_t i = 0; i < line.size(); ++i)
        EXPECT_NEAR(camera_center(line[i]).x, 0.5 * static_cast<double>(i), 1e-9);
    // A whole turn in one place, over which the signs of quaternions change.
    keys.clear();
    for (int i = 0; i < 8; ++i)
        keys.push_back(
            at({}, {std::sin(i * std::numbers::pi / 4), 0, std::cos(i * std::numbers::pi / 4)}));
    const std::vector<Camera> turn = camera_path(keys, 80, true).value();
    for (std::size_t i = 0; i < turn.size(); ++i) {
        EXPECT_LT(difference(turn[i], turn[(i + 1) % turn.size()]), 0.1) << i;
        EXPECT_LT(glm::length(camera_center(turn[i])), 1e-9);
    }
}

TEST(CameraPath, RefusesOnePlace) {
    const std::vector<Camera> keys(3, ring(4)[0]);
    EXPECT_ERROR(camera_path(keys, 5, true), Code::kInvalidArgument, "1 different poses");
    EXPECT_ERROR(camera_path({}, 5, false), Code::kInvalidArgument, "0 different poses");
}

}  // namespace
}  // namespace splat::scene
