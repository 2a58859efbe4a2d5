// Readers and writers of cameras: transforms.json and COLMAP.

#include <gtest/gtest.h>

#include <cmath>

#include "io/colmap.h"
#include "io/file.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/transforms_json.h"
#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/real_data.h"

namespace splat::io {
namespace {

using test::bytes_of;

const std::string kPose = R"("transform_matrix": [[1,0,0,5],[0,1,0,6],[0,0,1,7],[0,0,0,1]])";

Result<CameraSet> read_json(const std::string& text) {
    return read_transforms_json(bytes_of(text));
}

std::vector<scene::Camera> sample_cameras() {
    scene::Statistics scene;
    scene.radius = 1.5;
    scene.center = {0.5, -1, 2};
    auto cameras = scene::orbit(scene, {.count = 3, .width = 64, .height = 48});
    EXPECT_OK(cameras.status());
    cameras.value()[1].cx = 30.25;
    cameras.value()[2].fy = 71.5;
    return cameras.value();
}

void expect_same(const std::vector<scene::Camera>& a, const std::vector<scene::Camera>& b,
                 double bound) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].name, b[i].name);
        EXPECT_EQ(a[i].width, b[i].width);
        EXPECT_EQ(a[i].height, b[i].height);
        EXPECT_NEAR(a[i].fx, b[i].fx, bound);
        EXPECT_NEAR(a[i].fy, b[i].fy, bound);
        EXPECT_NEAR(a[i].cx, b[i].cx, bound);
        EXPECT_NEAR(a[i].cy, b[i].cy, bound);
        for (std::size_t k = 0; k < 16; ++k)
            EXPECT_NEAR(a[i].world_to_camera[k], b[i].world_to_camera[k], bound);
    }
}

TEST(TransformsJson, RoundTrip) {
    const auto cameras = sample_cameras();
    const auto file = write_transforms_json(cameras);
    ASSERT_OK(file.status());
    const auto read = read_transforms_json(file.value());
    ASSERT_OK(read.status());
    expect_same(read.value().cameras, cameras, 1e-12);
    auto broken = cameras;
    broken[0].fx = 0;
    EXPECT_ERROR(write_transforms_json(broken).status(), Code::kInvalidArgument, "focal");
}

TEST(TransformsJson, AnglesSizesAndOverrides) {
    const auto read =
        read_json(R"({"camera_angle_x": 1.5707963267948966, "w": 200, "h": 100, "frames": [
        {"file_path": "a", )" +
                  kPose + R"(},
        {"file_path": "b", "fl_x": 7, "cx": 3, "w": 50, "camera_angle_y": 1.5707963267948966, )" +
                  kPose + R"(}]})");
    ASSERT_OK(read.status());
    const auto& cameras = read.value().cameras;
    EXPECT_NEAR(cameras[0].fx, 100, 1e-9);
    EXPECT_NEAR(cameras[0].fy, 100, 1e-9);
    EXPECT_EQ(cameras[0].cy, 50);
    EXPECT_EQ(cameras[0].world_to_camera[3], -5);
    EXPECT_EQ(cameras[0].world_to_camera[7], 6) << "y is turned";
    EXPECT_EQ(cameras[1].fx, 7);
    EXPECT_NEAR(cameras[1].fy, 50, 1e-9) << "of the height";
    EXPECT_EQ(cameras[1].cx, 3);
    EXPECT_EQ(cameras[1].width, 50U);
    const auto sized =
        read_transforms_json(bytes_of(R"({"fl_x": 9, "frames": [{)" + kPose + "}]}"), 30, 20);
    ASSERT_OK(sized.status());
    EXPECT_EQ(sized.value().cameras[0].width, 30U);
    EXPECT_EQ(sized.value().cameras[0].fy, 9);
}

TEST(TransformsJson, ErrorsNameFrameAndKey) {
    const auto refused = [](const std::string& text, Code code, const char* part) {
        EXPECT_ERROR(read_json(text).status(), code, part);
    };
    const std::string size = R"("w": 4, "h": 4, )";
    const auto one = [](const std::string& members) {
        return R"({"frames": [{)" + members + "}]}";
    };
    refused("[]", Code::kFormat, "no list 'frames'");
    refused(R"({"frames": [3]})", Code::kFormat, "frame 0: it is not an object");
    refused(one(R"("fl_x": 1, )" + kPose), Code::kFormat, "'w' is 0");
    refused(one(size + kPose), Code::kFormat, "neither 'fl_x' nor 'camera_angle_x'");
    refused(one(size + R"("fl_x": "1", )" + kPose), Code::kFormat, "'fl_x' is not a number");
    refused(one(size + R"("fl_x": -1, )" + kPose), Code::kFormat, "focal");
    refused(one(size + R"("fl_x": 1, "file_path": 1, )" + kPose), Code::kFormat, "'file_path'");
    refused(one(size + R"("fl_x": 1)"), Code::kFormat, "'transform_matrix' is missing");
    refused(one(size + R"("fl_x": 1, "transform_matrix": [[1],[2],[3],[4]])"), Code::kFormat,
            "row 0");
    refused(
        one(size + R"("fl_x": 1, "transform_matrix": [[0,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]])"),
        Code::kFormat, "singular");
    refused(one(size + R"("fl_x": 1, "k1": 0.1, )" + kPose), Code::kUnsupported,
            "distortion k1 = 0.1");
    CameraOptions lenient;
    lenient.ignore_distortion = true;
    const auto read = read_transforms_json(
        bytes_of(one(size + R"("fl_x": 1, "k1": 0.1, "k2": 0, )" + kPose)), 0, 0, lenient);
    ASSERT_OK(read.status());
    EXPECT_EQ(read.value().warnings.size(), 1U);
}

TEST(TransformsJson, RefusesEveryPrefixAndSurvivesDamage) {
    const Buffer file = bytes_of(R"({"w":4,"h":4,"fl_x":1,"frames":[{)" + kPose + "}]}");
    const auto accepts = [](Bytes bytes) { return read_transforms_json(bytes).ok(); };
    EXPECT_TRUE(accepts(file));
    test::expect_prefixes_refused(file, accepts);
    test::parse_damaged(file, accepts);
}

TEST(Colmap, TextAndBinaryAgree) {
    const auto text =
        read_colmap_text(bytes_of(test::kColmapCameras), bytes_of(test::kColmapImages));
    const auto binary =
        read_colmap_binary(test::sample_colmap_cameras(), test::sample_colmap_images());
    ASSERT_OK(text.status());
    ASSERT_OK(binary.status());
    auto cameras = text.value().cameras;
    ASSERT_EQ(cameras.size(), 3U);
    EXPECT_EQ(cameras[2].name, "d.png");
    EXPECT_EQ(cameras[2].fy, 51);
    cameras.pop_back();
    expect_same(cameras, binary.value().cameras, 1e-15);
    EXPECT_EQ(cameras[0].name, "a b.png");
    EXPECT_EQ(cameras[0].world_to_camera[11], 3);
    EXPECT_EQ(cameras[1].fx, 9);
    EXPECT_EQ(cameras[1].fy, 9);
    EXPECT_EQ(cameras[1].cy, 10);
    EXPECT_NEAR(cameras[1].world_to_camera[2], 1, 1e-12) << "120 degrees about (1,1,1)";
}

TEST(Colmap, ErrorsNameLineAndCause) {
    const auto refused = [](const std::string& cameras, const std::string& images, Code code,
                            const char* part) {
        EXPECT_ERROR(read_colmap_text(bytes_of(cameras), bytes_of(images)).status(), code, part);
    };
    const std::string image = "1 1 0 0 0 1 2 3 1 a.png\n\n";
    refused("1 FISHEYE 1 1 1", image, Code::kUnsupported,
            "'FISHEYE', expected one of SIMPLE_PINHOLE");
    refused("\n1 PINHOLE 64 48 50 x", image, Code::kFormat, "cameras.txt line 2: parameter is 'x'");
    refused("1 PINHOLE 64 48 50", image, Code::kFormat, "there is no parameter");
    refused(test::kColmapCameras, "1 1 0 0 0 1 2 3 9 a.png", Code::kFormat,
            "camera 9, which does not exist");
    refused(test::kColmapCameras, "1 1 0 0 0 1 2 3 1", Code::kFormat, "no name");
    refused(test::kColmapCameras, "1 0 0 0 0 1 2 3 1 a", Code::kFormat, "quaternion of length 0");
    refused(test::kColmapCameras, "1 1 0 0 0 1 2 3 4 a", Code::kUnsupported, "distortion k = 0.5");
    refused("1 PINHOLE 99999 48 50 50 1 1", image, Code::kFormat, "99999 x 48");
    CameraOptions one;
    one.max_cameras = 1;
    EXPECT_ERROR(
        read_colmap_text(bytes_of(test::kColmapCameras), bytes_of(test::kColmapImages), one)
            .status(),
        Code::kUnsupported, "more than 1");
}

TEST(Colmap, BinaryRefusesPrefixesDamageAndHostileCounts) {
    const Buffer cameras = test::sample_colmap_cameras();
    const Buffer images = test::sample_colmap_images();
    const auto by_cameras = [&](Bytes bytes) { return read_colmap_binary(bytes, images).ok(); };
    const auto by_images = [&](Bytes bytes) { return read_colmap_binary(cameras, bytes).ok(); };
    test::expect_prefixes_refused(cameras, by_cameras);
    test::expect_prefixes_refused(images, by_images);
    test::parse_damaged(cameras, by_cameras);
    test::parse_damaged(images, by_images);
    Buffer many;
    put(many, ~std::uint64_t{0});
    EXPECT_ERROR(read_colmap_binary(many, images).status(), Code::kFormat, "'records'");
    EXPECT_ERROR(read_colmap_binary(cameras, many).status(), Code::kFormat, "'records'");
}

TEST(RealCameras, JsonAndColmapOfOneOrbitAgree) {
    SPLAT_NEEDS_REAL_DATA();
    const std::string folder = *test::real_data_folder() + "/images/guitar_orbit";
    const auto file = read_file(folder + "/transforms.json");
    ASSERT_OK(file.status());
    const auto json = read_transforms_json(file.value());
    const auto model = load_colmap(folder);
    ASSERT_OK(json.status());
    ASSERT_OK(model.status());
    auto cameras = json.value().cameras;
    ASSERT_EQ(cameras.size(), 14U);
    for (scene::Camera& camera : cameras) camera.name = camera.name.substr(7);  // images/
    expect_same(model.value().cameras, cameras, 1e-5);
    EXPECT_ERROR(load_colmap(folder + "/images").status(), Code::kNotFound, "no COLMAP model");
}

}  // namespace
}  // namespace splat::io
