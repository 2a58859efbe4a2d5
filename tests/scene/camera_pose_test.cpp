#include "scene/camera_pose.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "support/expect_status.h"

namespace splat::scene {
namespace {

/// Pixel of a point, and its depth.
Vec3 project(const Camera& c, const Vec3& p) {
    const Vec3 q = rotation_of(c.world_to_camera) * p + translation_of(c.world_to_camera);
    return {c.fx * q[0] / q[2] + c.cx, c.fy * q[1] / q[2] + c.cy, q[2]};
}

Camera sample_camera() {
    auto camera = need(camera_from_fov(640, 480, 1.0));
    auto pose = need(look_at({1, -2, -5}, {0.5, 0, 0}, kUp));
    camera.world_to_camera = pose;
    return camera;
}

TEST(CameraPose, FieldOfViewReachesTheEdges) {
    const auto camera = need(camera_from_fov(200, 100, std::numbers::pi / 2));
    EXPECT_NEAR(camera.fx, 100, 1e-9);
    EXPECT_NEAR(project(camera, {1, 0, 1})[0], 200, 1e-9);
    EXPECT_NEAR(project(camera, {0, 0, 1})[1], 50, 1e-9);
    for (const double angle : {0.0, -1.0, 4.0, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_FALSE(camera_from_fov(10, 10, angle).ok());
    EXPECT_ERROR(camera_from_fov(0, 10, 1), Code::kInvalidArgument, "0 x 10 pixels");
}

TEST(CameraPose, LookAtPutsTheTargetInTheMiddle) {
    const Camera camera = sample_camera();
    EXPECT_OK(check_camera(camera));
    const Vec3 target = project(camera, {0.5, 0, 0});
    EXPECT_NEAR(target[0], 320, 1e-9);
    EXPECT_NEAR(target[1], 240, 1e-9);
    EXPECT_NEAR(target[2], std::sqrt(0.25 + 4 + 25), 1e-9);
    EXPECT_LT(project(camera, {0.5, -1, 0})[1], 240) << "-y is up";
    EXPECT_GT(project(camera, {1.5, 0, 0})[0], 320) << "+x is right";
    const Vec3 center = camera_center(camera);
    EXPECT_NEAR(center[0], 1, 1e-9);
    EXPECT_NEAR(center[1], -2, 1e-9);
    EXPECT_NEAR(center[2], -5, 1e-9);
    EXPECT_FALSE(look_at({0, 0, 0}, {0, 0, 0}, kUp).ok());
    EXPECT_FALSE(look_at({0, 0, 0}, {0, 5, 0}, kUp).ok());
    EXPECT_FALSE(look_at({0, 0, 0}, {0, 0, 1}, {0, 0, 0}).ok());
}

TEST(CameraPose, OpenGlAndOpenCvAreInverse) {
    const Camera camera = sample_camera();
    const auto gl = need(opengl_from_opencv(camera.world_to_camera));
    EXPECT_NEAR(gl[3], 1, 1e-12) << "the last column is the camera's place";
    EXPECT_NEAR(gl[7], -2, 1e-12);
    const auto back = need(opencv_from_opengl(gl));
    for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(back[i], camera.world_to_camera[i], 1e-12);
    // A camera of OpenGL at the origin looks along -z with y up.
    const auto cv = need(opencv_from_opengl(kNoPose));
    EXPECT_EQ(cv[5], -1);
    EXPECT_EQ(cv[10], -1);
    EXPECT_FALSE(std::signbit(cv[3])) << "the origin, and no -0 in files";
}

TEST(CameraPose, PosesRoundedToFloatsKeepTheirPlaces) {
    Camera camera = sample_camera();
    for (const std::size_t i : {0U, 1U, 2U, 4U, 5U, 6U, 8U, 9U, 10U})
        camera.world_to_camera[i] =
            static_cast<double>(static_cast<float>(camera.world_to_camera[i]));
    camera.world_to_camera[3] = 100;
    camera.world_to_camera[7] = 50;
    camera.world_to_camera[11] = 7;
    const auto back = need(opencv_from_opengl(need(opengl_from_opencv(camera.world_to_camera))));
    for (std::size_t i = 0; i < 16; ++i)
        EXPECT_NEAR(back[i], camera.world_to_camera[i], 1e-12) << i;
}

TEST(CameraPose, QuaternionPose) {
    const double h = std::sqrt(0.5);
    const auto pose = need(pose_from_quaternion({2 * h, 0, 0, 2 * h}, {1, 2, 3}));
    const double expected[] = {0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1};
    for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(pose[i], expected[i], 1e-12);
    EXPECT_FALSE(pose_from_quaternion({0, 0, 0, 0}, {}).ok());
}

TEST(CameraPose, ChecksFindEveryDefect) {
    const auto refused = [](auto change, const char* part) {
        Camera camera = sample_camera();
        camera.name = "c";
        change(camera);
        EXPECT_ERROR(check_camera(camera), Code::kInvalidArgument, part);
    };
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    refused([](Camera& c) { c.width = 0; }, "camera 'c': 0 x 480");
    refused([](Camera& c) { c.height = 20000; }, "640 x 20000");
    refused([](Camera& c) { c.fx = 0; }, "focal");
    refused([](Camera& c) { c.fy = kNan; }, "focal");
    refused([](Camera& c) { c.cx = kNan; }, "principal");
    refused([](Camera& c) { c.fx = 5e-312; }, "camera 'c': focal lengths are 5e-312 and");
    refused([](Camera& c) { c.fy = 1e300; }, "expected 1e-06 to 1e+09");
    refused([](Camera& c) { c.cx = 1e308; }, "the principal point is 1e+308, 240 pixels, expected");
    refused([](Camera& c) { c.cy = -2e6; }, "expected -1.04858e+06 to 1.04858e+06");
    refused([](Camera& c) { c.world_to_camera[3] = kNan; }, "not finite");
    refused([](Camera& c) { c.world_to_camera[12] = 1; }, "last row");
    refused([](Camera& c) { c.world_to_camera = {}; }, "last row");
    refused(
        [](Camera& c) {
            for (int i = 0; i < 3; ++i) c.world_to_camera[static_cast<std::size_t>(i)] = 0;
        },
        "singular");
    refused(
        [](Camera& c) {
            for (std::size_t i = 0; i < 3; ++i) c.world_to_camera[i] *= -1;
        },
        "mirrors");
    refused(
        [](Camera& c) {
            for (std::size_t i = 0; i < 11; ++i) c.world_to_camera[i] *= 1.01;
        },
        "product");
}

}  // namespace
}  // namespace splat::scene
