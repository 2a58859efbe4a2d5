// Readers and writers of cameras: transforms.json and COLMAP.

#include <gtest/gtest.h>

#include "io/colmap.h"
#include "io/file.h"
#include "io/mesh/mesh.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/transforms_json.h"
#include "scene/orbit.h"
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
    auto cameras =
        need(scene::orbit(test::sample_scene(8, 0), {.count = 3, .width = 64, .height = 48}));
    cameras[1].cx = 30.25;
    cameras[2].fy = 71.5;
    return cameras;
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
    const auto read = need(read_transforms_json(need(write_transforms_json(cameras))));
    expect_same(read.cameras, cameras, 1e-12);
    auto broken = cameras;
    broken[0].fx = 0;
    EXPECT_ERROR(write_transforms_json(broken), Code::kInvalidArgument, "focal");
}

TEST(TransformsJson, AnglesSizesAndOverrides) {
    const auto cameras =
        need(read_json(R"({"camera_angle_x": 1.5707963267948966, "w": 200, "h": 100, "frames": [
        {"file_path": "a", )" +
                       kPose + R"(},
        {"file_path": "b", "fl_x": 7, "cx": 3, "w": 50, "camera_angle_y": 1.5707963267948966, )" +
                       kPose + R"(}]})"))
            .cameras;
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
        need(read_transforms_json(bytes_of(R"({"fl_x": 9, "frames": [{)" + kPose + "}]}"), 30, 20));
    EXPECT_EQ(sized.cameras[0].width, 30U);
    EXPECT_EQ(sized.cameras[0].fy, 9);
}

TEST(TransformsJson, ErrorsNameFrameAndKey) {
    const auto refused = [](const std::string& text, Code code, const char* part) {
        EXPECT_ERROR(read_json(text), code, part);
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
    for (const char* angle : {"0", "-1", "3.141592653589793", "50", "7"})
        refused(one(size + R"("camera_angle_x": )" + angle + ", " + kPose), Code::kFormat,
                "expected radians between 0 and pi");
    refused(one(size + R"("fl_x": 1, "camera_angle_y": 50, )" + kPose), Code::kFormat,
            "frame 0: 'camera_angle_y' is 50, expected radians");
    refused(one(size + R"("fl_x": 1, "fl_x": 2, )" + kPose), Code::kFormat, "'fl_x' appears twice");
    refused(R"({"frames": [], "frames": []})", Code::kFormat, "'frames' appears twice");
    refused(one(size + R"("fl_x": 1, "file_path": "rgb/0.png\u0000x", )" + kPose), Code::kFormat,
            "an escaped NUL");
    refused(one(size + R"("fl_x": 1, "k1": 0.1, "file_path": ")" + std::string(5000, 'n') + "\", " +
                kPose),
            Code::kUnsupported, "nnn...': distortion");
}

TEST(TransformsJson, LensesOtherThanPinholes) {
    const auto file = [](const std::string& members) {
        return bytes_of(R"({"w": 4, "h": 4, "fl_x": 1, )" + members +
                        R"("frames": [{"file_path": "a", )" + kPose + "}]}");
    };
    CameraOptions lenient{.ignore_distortion = true};
    const std::pair<const char*, const char*> lenses[] = {
        {R"("k1": 0.1, "k2": 0, )", "camera 'a': distortion k1 = 0.1"},
        {R"("k5": 0.1, )", "camera 'a': distortion k5 = 0.1"},
        {R"("k6": -1, )", "camera 'a': distortion k6 = -1"},
        {R"("camera_model": "OPENCV_FISHEYE", )", "camera 'a': camera_model 'OPENCV_FISHEYE'"},
        {R"("camera_model": "EQUIRECTANGULAR", )", "camera 'a': camera_model 'EQUIRECTANGULAR'"},
        {R"("is_fisheye": true, )", "camera 'a': is_fisheye"}};
    for (const auto& [members, found] : lenses) {
        EXPECT_ERROR(read_transforms_json(file(members)), Code::kUnsupported,
                     std::string(found) + ", only pinhole cameras are supported");
        const auto read = need(read_transforms_json(file(members), 0, 0, lenient));
        EXPECT_EQ(read.warnings, std::vector<std::string>{std::string(found) + " is ignored"});
    }
    for (const char* model :
         {"PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV"})
        EXPECT_OK(read_transforms_json(file(std::string(R"("camera_model": ")") + model + "\", ")));
    EXPECT_OK(read_transforms_json(file(R"("camera_model": null, "is_fisheye": false, )")));
    EXPECT_ERROR(read_transforms_json(file(R"("camera_model": 3, )")), Code::kFormat,
                 "'camera_model' is not text");
    EXPECT_ERROR(read_transforms_json(file(R"("is_fisheye": 1, )")), Code::kFormat,
                 "'is_fisheye' is not true or false");
}

TEST(TransformsJson, KeepsLenses) {
    const auto lens = [](const std::string& members) {
        const auto set =
            need(read_transforms_json(bytes_of(R"({"w": 4, "h": 4, "fl_x": 1, )" + members +
                                               R"("frames": [{"file_path": "a", )" + kPose + "}]}"),
                                      0, 0, {.keep_lens = true}));
        EXPECT_TRUE(set.warnings.empty());
        return set.lenses.at(0);
    };
    EXPECT_TRUE(scene::is_pinhole(lens("")));
    const std::string four = R"("k1": 0.1, "k2": 0.2, "p1": 0.3, "p2": 0.4, )";
    scene::Lens expected;
    expected.radial = {0.1, 0.2, 0, 0};
    expected.tangential = {0.3, 0.4};
    EXPECT_EQ(lens(four), expected);
    expected.radial[2] = 0.5;
    expected.radial[3] = 0.6;
    EXPECT_EQ(lens(four + R"("k3": 0.5, "k4": 0.6, )"), expected) << "nerfstudio's k4 is of r^8";
    std::swap(expected.radial[3], expected.denominator[0]);
    const std::string rational = four + R"("k3": 0.5, "k4": 0.6, "camera_model": "FULL_OPENCV", )";
    EXPECT_EQ(lens(rational), expected);
    expected.denominator[2] = 0.7;
    EXPECT_EQ(lens(four + R"("k3": 0.5, "k4": 0.6, "k6": 0.7, )"), expected);
    scene::Lens fisheye{.kind = scene::LensKind::kFisheye};
    fisheye.radial = {0.1, 0, 0, -0.2};
    for (const char* kind : {R"("camera_model": "OPENCV_FISHEYE", )", R"("is_fisheye": true, )"})
        EXPECT_EQ(lens(std::string(kind) + R"("k1": 0.1, "k4": -0.2, )"), fisheye);
    const auto refused = [](const std::string& members, const char* part) {
        EXPECT_ERROR(
            read_transforms_json(bytes_of(R"({"w": 4, "h": 4, "fl_x": 1, )" + members +
                                          R"("frames": [{"file_path": "a", )" + kPose + "}]}"),
                                 0, 0, {.keep_lens = true}),
            Code::kUnsupported, part);
    };
    refused(R"("camera_model": "EQUIRECTANGULAR", )", "camera_model 'EQUIRECTANGULAR'");
    refused(R"("is_fisheye": true, "k5": 1, )", "k5 = 1 of a fisheye");
}

TEST(TransformsJson, NamesItsPoints) {
    const auto read = [](const std::string& points) {
        return read_transforms_json(bytes_of(R"({"w": 4, "h": 4, "fl_x": 1, "ply_file_path": )" +
                                             points + R"(, "frames": [{)" + kPose + "}]}"));
    };
    EXPECT_EQ(need(read(R"("a.ply")")).points, "a.ply");
    EXPECT_EQ(need(read("null")).points, "");
    EXPECT_ERROR(read("3"), Code::kFormat, "'ply_file_path' is not text");
}

TEST(TransformsJson, RefusesEveryPrefixAndSurvivesDamage) {
    const Buffer file = bytes_of(R"({"w":4,"h":4,"fl_x":1,"frames":[{)" + kPose + "}]}");
    const auto accepts = [](Bytes bytes) { return read_transforms_json(bytes).ok(); };
    EXPECT_TRUE(accepts(file));
    test::expect_sturdy(file, accepts);
}

TEST(Colmap, TextAndBinaryAgree) {
    const auto text =
        need(read_colmap_text(bytes_of(test::kColmapCameras), bytes_of(test::kColmapImages)));
    const auto binary =
        need(read_colmap_binary(test::sample_colmap_cameras(), test::sample_colmap_images()));
    auto cameras = text.cameras;
    ASSERT_EQ(cameras.size(), 3U);
    EXPECT_EQ(cameras[2].name, "d.png");
    EXPECT_EQ(cameras[2].fy, 51);
    cameras.pop_back();
    expect_same(cameras, binary.cameras, 1e-15);
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
        EXPECT_ERROR(read_colmap_text(bytes_of(cameras), bytes_of(images)), code, part);
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
    refused("1 PINHOLE 64 48 50 50 1 1 0.5", image, Code::kFormat,
            "cameras.txt line 1: more than the 4 parameters of PINHOLE");
    refused("1 PINHOLE 4 4 5 5 2 2\n1 PINHOLE 4 4 9 9 2 2\n", image, Code::kFormat,
            "cameras.txt line 2: camera id 1 appears twice");
    const std::string cameras = test::kColmapCameras;
    refused(cameras, image + image, Code::kFormat, "images.txt line 3: image id 1 appears twice");
    refused(cameras, "1 1 0 0 0 1 2 3 1 a\n2 1 0 0 0 1 2 3 1 b\n", Code::kFormat,
            "images.txt line 2: expected the points of the image 'a'");
    for (const char* points : {"1 2", "1 2 3 4", "1 2 x"})
        refused(cameras, std::string("1 1 0 0 0 1 2 3 1 a\n") + points, Code::kFormat,
                "expected the points");
    refused(cameras, std::string("1 1 0 0 0 1 2 3 1 a\0b\n", 23), Code::kFormat, "a NUL");
    refused(cameras, "# nothing\n", Code::kFormat, "images.txt: there is no image");
    EXPECT_ERROR(read_colmap_text(bytes_of(test::kColmapCameras), bytes_of(test::kColmapImages),
                                  {.max_cameras = 1}),
                 Code::kUnsupported, "more than 1");
}

/// A model of COLMAP that is no pinhole, with `focals` focal lengths and so many parameters.
struct OtherLens {
    const char* name;
    std::int32_t id;
    std::size_t focals;
    std::size_t parameters;
    const char* text;  ///< with parameters of 0.25
};
constexpr OtherLens kOtherLenses[] = {
    {"OPENCV_FISHEYE", 5, 2, 8, "fisheye k1 = 0.25, k2 = 0.25, k3 = 0.25, k4 = 0.25"},
    {"FULL_OPENCV", 6, 2, 12,
     "perspective k1 = 0.25, k2 = 0.25, k3 = 0.25, k4 = 0.25, k5 = 0.25, k6 = 0.25, p1 = 0.25, p2 "
     "= 0.25"},
    {"FOV", 7, 2, 5, "FOV omega = 0.25"},
    {"SIMPLE_RADIAL_FISHEYE", 8, 1, 4, "fisheye k1 = 0.25"},
    {"RADIAL_FISHEYE", 9, 1, 5, "fisheye k1 = 0.25, k2 = 0.25"},
    {"THIN_PRISM_FISHEYE", 10, 2, 12,
     "fisheye k1 = 0.25, k2 = 0.25, k3 = 0.25, k4 = 0.25, p1 = 0.25, p2 = 0.25, sx1 = 0.25, sy1 = "
     "0.25"}};

TEST(Colmap, OtherLensesAreRefusedOrReadAsPinholes) {
    CameraOptions ignore{.ignore_distortion = true};
    for (const OtherLens& lens : kOtherLenses) {
        SCOPED_TRACE(lens.name);
        std::string text = "1 " + std::string(lens.name) + " 64 48";
        Buffer binary;
        put(binary, std::uint64_t{1});
        put(binary, std::int32_t{1});
        put(binary, lens.id);
        put(binary, std::uint64_t{64});
        put(binary, std::uint64_t{48});
        for (std::size_t i = 0; i < lens.parameters; ++i) {
            const double value =
                i < lens.focals ? 50 + static_cast<double>(i) : (i < lens.focals + 2 ? 30 : 0.25);
            text += format(" %g", value);
            put(binary, value);
        }
        const Buffer images = bytes_of("1 1 0 0 0 1 2 3 1 a.png\n\n");
        const Buffer binary_images = [] {
            Buffer one = test::sample_colmap_images();
            one[0] = std::byte{1};
            one.resize(8 + 4 + 7 * 8 + 4 + 8 + 8 + 24);  // name and NUL, points
            return one;
        }();
        for (const bool is_text : {true, false}) {
            const auto read = [&](const CameraOptions& options) {
                return is_text ? read_colmap_text(bytes_of(text), images, options)
                               : read_colmap_binary(binary, binary_images, options);
            };
            EXPECT_ERROR(read({}), Code::kUnsupported, "only pinhole cameras");
            const auto found = need(read(ignore));
            const scene::Camera& camera = found.cameras.at(0);
            EXPECT_EQ(camera.fx, 50);
            EXPECT_EQ(camera.fy, lens.focals == 1 ? 50 : 51);
            EXPECT_EQ(camera.cx, 30);
            EXPECT_EQ(camera.cy, 30);
            EXPECT_FALSE(found.warnings.empty());
            const auto kept = need(read({.keep_lens = true}));
            EXPECT_TRUE(kept.warnings.empty());
            EXPECT_EQ(kept.lenses, found.lenses);
            EXPECT_EQ(scene::lens_text(kept.lenses.at(0)), lens.text);
        }
        EXPECT_ERROR(read_colmap_text(bytes_of(text + " 1"), images, ignore), Code::kFormat,
                     lens.name);
    }
}

/// Parameters of one value each have their places.
TEST(Colmap, KeepsParametersInTheirOrder) {
    const Buffer images = bytes_of("1 1 0 0 0 1 2 3 1 a.png\n\n");
    const auto lens = [&](const char* text) {
        return scene::lens_text(
            need(read_colmap_text(bytes_of(text), images, {.keep_lens = true})).lenses.at(0));
    };
    EXPECT_EQ(lens("1 PINHOLE 9 9 9 9 5 5"), "perspective");
    EXPECT_EQ(lens("1 SIMPLE_RADIAL 9 9 9 5 5 1"), "perspective k1 = 1");
    EXPECT_EQ(lens("1 RADIAL 9 9 9 5 5 1 2"), "perspective k1 = 1, k2 = 2");
    EXPECT_EQ(lens("1 OPENCV 9 9 9 9 5 5 1 2 3 4"), "perspective k1 = 1, k2 = 2, p1 = 3, p2 = 4");
    EXPECT_EQ(lens("1 FULL_OPENCV 9 9 9 9 5 5 1 2 3 4 5 6 7 8"),
              "perspective k1 = 1, k2 = 2, k3 = 5, k4 = 6, k5 = 7, k6 = 8, p1 = 3, p2 = 4");
    EXPECT_EQ(lens("1 THIN_PRISM_FISHEYE 9 9 9 9 5 5 1 2 3 4 5 6 7 8"),
              "fisheye k1 = 1, k2 = 2, k3 = 5, k4 = 6, p1 = 3, p2 = 4, sx1 = 7, sy1 = 8");
}

/// 50 pictures of one lens are one warning, which names what is ignored of it.
TEST(Colmap, OneWarningTellsOfManyCameras) {
    CameraOptions ignore{.ignore_distortion = true};
    std::string images;
    for (int i = 1; i <= 50; ++i) images += format("%d 1 0 0 0 0 0 4 1 %02d.png\n\n", i, i);
    const auto set = need(read_colmap_text(bytes_of("1 OPENCV 64 48 50 50 32 24 0.1 0 0.02 0"),
                                           bytes_of(images), ignore));
    EXPECT_EQ(set.warnings,
              std::vector<std::string>{"50 cameras, such as '01.png': distortion k1 = 0.1, "
                                       "distortion p1 = 0.02 is ignored"});
    const auto refused = [&](bool may_ignore) {
        return read_colmap_text(bytes_of("1 OPENCV 64 48 50 50 32 24 0.1 0 0.02 0"),
                                bytes_of(images), {.may_ignore = may_ignore})
            .status()
            .message();
    };
    EXPECT_EQ(refused(false),
              "camera '01.png': distortion k1 = 0.1, only pinhole cameras are supported: undistort "
              "the images ('colmap image_undistorter' makes images and cameras of a COLMAP model)");
    EXPECT_HAS(refused(true), ", or ignore it (SPLAT_CAMERA_IGNORE_DISTORTION)");
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
    const auto counted = [](const Buffer& file, std::uint64_t count) {
        Buffer changed;
        put(changed, count);
        put_bytes(changed, Bytes(file).subspan(sizeof count));
        return changed;
    };
    EXPECT_ERROR(read_colmap_binary(counted(cameras, 1), images), Code::kFormat,
                 "COLMAP cameras.bin: 48 bytes after the last of 1 records, at byte 64");
    EXPECT_ERROR(read_colmap_binary(cameras, counted(images, 1)), Code::kFormat,
                 "after the last of 1 records");
    const auto appended = [](Buffer file) {
        file.push_back(std::byte{0});
        return file;
    };
    EXPECT_ERROR(read_colmap_binary(appended(cameras), images), Code::kFormat,
                 "cameras.bin: 1 bytes after");
    EXPECT_ERROR(read_colmap_binary(cameras, appended(images)), Code::kFormat,
                 "images.bin: 1 bytes after");
    const auto repeated = [](Buffer file) {  // the first record once more
        Buffer twice;
        put(twice, number<std::uint64_t>(file.data()) + 1);
        file.erase(file.begin(), file.begin() + sizeof(std::uint64_t));
        put_bytes(twice, file);
        put_bytes(twice, file);
        return twice;
    };
    EXPECT_ERROR(read_colmap_binary(repeated(cameras), images), Code::kFormat,
                 "cameras.bin: camera id 1, at byte ");
    EXPECT_ERROR(read_colmap_binary(cameras, repeated(images)), Code::kFormat,
                 "images.bin: image id 1, at byte ");
    Buffer none;
    put(none, std::uint64_t{0});
    EXPECT_ERROR(read_colmap_binary(cameras, none), Code::kFormat, "there is no image");
    Buffer many;
    put(many, ~std::uint64_t{0});
    EXPECT_ERROR(read_colmap_binary(many, images), Code::kFormat, "'records'");
    EXPECT_ERROR(read_colmap_binary(cameras, many), Code::kFormat, "'records'");
}

using ColmapPoints = test::FolderTest;

TEST_F(ColmapPoints, HaveColours) {
    const auto write = [this](const char* name, const Buffer& file) {
        ASSERT_OK(write_file(path(name), file));
    };
    EXPECT_TRUE(need(load_colmap_points(folder_.string())).positions.empty()) << "no model";
    write("cameras.txt", bytes_of(test::kColmapCameras));
    EXPECT_TRUE(need(load_colmap_points(folder_.string())).positions.empty()) << "no points";
    write("points3D.txt", bytes_of("# a comment\n5 1 2 3 4 5 255 0.5 1 2\n2 0 0 0 0 0 0 0\n"));
    const auto points = need(load_colmap_points(folder_.string()));
    ASSERT_EQ(points.positions.size(), 2U);
    ASSERT_EQ(points.colors.size(), 2U);
    EXPECT_EQ(points.positions[0], scene::Vec3(1, 2, 3));
    EXPECT_EQ(points.colors[0], (std::array<std::uint8_t, 3>{4, 5, 255}));
    for (const char* bad : {"1 2 3 4", "1 2 3 4 5 6", "1 2 3 4 5 6 256", "1 2 3 4 5 6 -1"}) {
        write("points3D.txt", bytes_of(bad));
        EXPECT_ERROR(load_colmap_points(folder_.string()), Code::kFormat, "colour") << bad;
    }
    write("cameras.bin", test::sample_colmap_cameras());
    Buffer binary;
    put(binary, std::uint64_t{1});
    put(binary, std::uint64_t{7});
    for (const double value : {1.0, 2.0, 3.0}) put(binary, value);
    for (const int value : {4, 5, 255}) put(binary, static_cast<std::uint8_t>(value));
    put(binary, 0.5);
    put(binary, std::uint64_t{1});
    put(binary, std::uint64_t{0});
    write("points3D.bin", binary);
    const auto same = need(load_colmap_points(folder_.string()));
    EXPECT_EQ(same.positions.at(0), points.positions[0]);
    EXPECT_EQ(same.colors.at(0), points.colors[0]);
    binary.pop_back();
    write("points3D.bin", binary);
    EXPECT_ERROR(load_colmap_points(folder_.string()), Code::kFormat, "track");
}

TEST(PlyPoints, HaveColoursIfTheyAreBytes) {
    const auto file = [](const char* type) {
        return bytes_of("ply\nformat ascii 1.0\nelement vertex 2\nproperty " + std::string(type) +
                        " green\nproperty uchar red\nproperty uchar blue\nproperty double x\n"
                        "property double y\nproperty double z\nend_header\n"
                        "2 1 3 4 5 6\n0 0 0 nan 0 0\n");
    };
    const auto points = need(read_ply_colored_points(file("uchar")));
    ASSERT_EQ(points.positions.size(), 2U);
    EXPECT_EQ(points.positions[0], scene::Vec3(4, 5, 6));
    ASSERT_EQ(points.colors.size(), 2U);
    EXPECT_EQ(points.colors[0], (std::array<std::uint8_t, 3>{1, 2, 3}));
    EXPECT_TRUE(need(read_ply_colored_points(file("float"))).colors.empty());
    EXPECT_ERROR(read_ply_points(file("uchar")), Code::kFormat, "vertex 1 is not finite");
}

TEST(RealCameras, JsonAndColmapOfOneOrbitAgree) {
    SPLAT_NEEDS_REAL_DATA();
    const std::string folder = *test::real_data_folder() + "/images/guitar_orbit";
    const auto json = need(read_transforms_json(need(read_file(folder + "/transforms.json"))));
    const auto model = need(load_colmap(folder));
    auto cameras = json.cameras;
    ASSERT_EQ(cameras.size(), 14U);
    for (scene::Camera& camera : cameras) camera.name = camera.name.substr(7);  // images/
    expect_same(model.cameras, cameras, 1e-5);
    EXPECT_ERROR(load_colmap(folder + "/images"), Code::kNotFound, "no COLMAP model");
}

}  // namespace
}  // namespace splat::io
