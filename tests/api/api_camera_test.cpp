// Cameras through the C API.
#include <array>
#include <cmath>
#include <fstream>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

/// Where the camera is: -R^T t.
std::array<double, 3> center_of(const splat_camera& camera) {
    const double* m = camera.world_to_camera;
    std::array<double, 3> center{};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t row = 0; row < 3; ++row) center[k] -= m[4 * row + k] * m[4 * row + 3];
    return center;
}

TEST(ApiCamera, LooksAtItsTarget) {
    splat_camera camera = sample_camera(64, 48);
    EXPECT_DOUBLE_EQ(camera.fx, 32 / std::tan(0.4));
    EXPECT_EQ(camera.fx, camera.fy);
    EXPECT_EQ(camera.cx, 32);
    EXPECT_EQ(camera.cy, 24);
    const auto center = center_of(camera);
    EXPECT_NEAR(center[0], 0, 1e-12);
    EXPECT_NEAR(center[1], 0.5, 1e-12);
    EXPECT_NEAR(center[2], -4, 1e-12);
    EXPECT_NEAR(camera.world_to_camera[11], std::sqrt(16.25), 1e-12) << "depth of the target";
    const double fx = camera.fx;
    const double eye[3] = {1, 0, 0};
    const double target[3] = {0, 0, 0};
    const double up[3] = {0, 0, 1};
    EXPECT_DONE(splat_camera_look_at(&camera, eye, target, up));
    EXPECT_EQ(camera.fx, fx) << "intrinsics stay";
}

TEST(ApiCamera, OpenGlAndBack) {
    const splat_camera camera = sample_camera(8, 8, 0.7);
    double matrix[16];
    ASSERT_DONE(splat_camera_to_opengl(&camera, matrix));
    const auto center = center_of(camera);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(matrix[4 * k + 3], center[k], 1e-12);
    splat_camera back = camera;
    for (double& value : back.world_to_camera) value = 0;
    ASSERT_DONE(splat_camera_from_opengl(&back, matrix));
    for (std::size_t i = 0; i < 16; ++i)
        EXPECT_NEAR(back.world_to_camera[i], camera.world_to_camera[i], 1e-12);
}

TEST(ApiCamera, OrbitsAScene) {
    const Scene scene = SampleScene(50).create();
    splat_camera cameras[4];
    auto desc = sized<splat_orbit_desc>();
    desc.width = 40;
    desc.height = 30;
    desc.distance = 5;
    ASSERT_DONE(splat_camera_orbit(scene, &desc, 4, cameras));
    const splat_scene_info info = info_of(scene);
    double middle[3] = {0, 0, 0};
    for (const splat_camera& camera : cameras)
        for (std::size_t k = 0; k < 3; ++k) middle[k] += center_of(camera)[k] / 4;
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_GT(middle[k], info.low[k]);
        EXPECT_LT(middle[k], info.high[k]);
    }
    for (const splat_camera& camera : cameras) {
        EXPECT_EQ(camera.width, 40U);
        const auto at = center_of(camera);
        EXPECT_NEAR(std::hypot(at[0] - middle[0], at[2] - middle[2]), 5, 1e-9);
        EXPECT_NEAR(at[1], middle[1], 1e-9) << "elevation 0";
    }
    EXPECT_NEAR(center_of(cameras[0])[2], middle[2] - 5, 1e-9) << "before the scene";
    ASSERT_DONE(splat_camera_orbit(scene, nullptr, 1, cameras));
    EXPECT_EQ(cameras[0].width, 512U);
    const Scene empty = empty_scene();
    EXPECT_REFUSED(splat_camera_orbit(empty, nullptr, 1, cameras), kArgument, "");
    EXPECT_DONE(splat_camera_orbit(empty, nullptr, 0, nullptr)) << "no cameras";
    desc.struct_size = 0;
    EXPECT_REFUSED(splat_camera_orbit(scene, &desc, 0, nullptr), kArgument, "struct_size");
}

TEST(ApiCamera, PathsGoThroughTheirKeys) {
    splat_camera keys[3], path[6];
    const double target[3] = {0, 0, 0}, up[3] = {0, -1, 0};
    for (int i = 0; i < 3; ++i) {
        ASSERT_DONE(splat_camera_from_fov(40, 30, 1, &keys[i]));
        const double eye[3] = {3 * std::cos(2.0944 * i), 0, 3 * std::sin(2.0944 * i)};
        ASSERT_DONE(splat_camera_look_at(&keys[i], eye, target, up));
    }
    ASSERT_DONE(splat_camera_path(keys, 3, 1, 6, path));
    EXPECT_EQ(path[5].width, 40U);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(center_of(path[0])[k], center_of(keys[0])[k], 1e-9);
        EXPECT_NEAR(center_of(path[2])[k], center_of(keys[1])[k], 1e-3);
    }
    EXPECT_DONE(splat_camera_path(keys, 3, 0, 0, nullptr)) << "no cameras";
    EXPECT_REFUSED(splat_camera_path(nullptr, 3, 0, 6, path), kArgument, "keys is NULL");
    EXPECT_REFUSED(splat_camera_path(keys, 3, 0, 6, nullptr), kArgument, "cameras is NULL");
    EXPECT_REFUSED(splat_camera_path(keys, 3, 2, 6, path), kArgument, "closed is 2");
    EXPECT_REFUSED(splat_camera_path(keys, 1, 0, 6, path), kArgument, "different poses");
    keys[1].fx = 0;
    EXPECT_REFUSED(splat_camera_path(keys, 3, 0, 6, path), kArgument, "keys[1]");
}

TEST(ApiCamera, FilesAreRead) {
    const Temporary path;
    std::ofstream(path.path()) << R"({"camera_angle_x": 0.8, "frames": [
        {"file_path": "a.png", "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]},
        {"file_path": "b.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})";
    auto desc = sized<splat_camera_file_desc>();
    desc.width = 20;
    desc.height = 10;
    std::uint32_t count = 0;
    splat_camera cameras[2] = {};
    EXPECT_EQ(splat_camera_load(path.c_str(), &desc, cameras, 1, &count), SPLAT_INCOMPLETE);
    EXPECT_EQ(count, 2U);
    EXPECT_EQ(cameras[0].width, 20U);
    EXPECT_EQ(cameras[1].width, 0U) << "beyond the capacity";
    ASSERT_DONE(splat_camera_load(path.c_str(), &desc, cameras, 2, nullptr));
    EXPECT_EQ(cameras[0].world_to_camera[3], -1);
    EXPECT_EQ(cameras[0].world_to_camera[7], 2) << "y is turned";
    EXPECT_EQ(cameras[0].world_to_camera[11], 3);
    const std::string report = text_of(splat_camera_load_report, path.c_str(), &desc);
    EXPECT_EQ(report, R"({"names": ["a.png", "b.png"], "warnings": []})");
    const std::string sentence = "'" + path.path() + "': frame 0: 'w' is 0";
    EXPECT_REFUSED(splat_camera_load(path.c_str(), nullptr, cameras, 2, nullptr), kFormat,
                   sentence.c_str());
}

TEST(ApiCamera, DistortionIsRefusedUnlessIgnored) {
    const Temporary folder;
    const std::string json = folder / "cameras.json";
    std::ofstream(json) << R"({"w": 20, "h": 10, "fl_x": 15, "k1": 0.25, "frames": [
        {"file_path": "a.png", "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]})";
    std::ofstream(folder / "cameras.txt") << "1 SIMPLE_RADIAL 20 10 15 10 5 0.25\n";
    std::ofstream(folder / "images.txt") << "1 1 0 0 0 1 2 3 1 a.png\n\n";
    for (const std::string& path : {json, folder.path()}) {
        splat_camera camera{};
        const std::string sentence = "'" + path;
        EXPECT_REFUSED(splat_camera_load(path.c_str(), nullptr, &camera, 1, nullptr), kUnsupported,
                       sentence.c_str());
        EXPECT_TRUE(holds(splat_last_error_message(), "SPLAT_CAMERA_IGNORE_DISTORTION"));
        EXPECT_EQ(camera.width, 0U) << "written although refused";
        auto desc = sized<splat_camera_file_desc>();
        desc.flags = SPLAT_CAMERA_IGNORE_DISTORTION;
        EXPECT_DONE(splat_camera_load(path.c_str(), &desc, &camera, 1, nullptr));
        EXPECT_EQ(camera.fx, 15);
        const std::string report = text_of(splat_camera_load_report, path.c_str(), &desc);
        EXPECT_TRUE(holds(report, "= 0.25 is ignored"));
        desc.flags = SPLAT_CAMERA_IGNORE_DISTORTION << 1U;
        EXPECT_REFUSED(splat_camera_load(path.c_str(), &desc, &camera, 1, nullptr), kArgument,
                       "flags");
    }
}

}  // namespace
}  // namespace splat::test
