// A small release of CO3D: what is written of it, and what is refused. tests/interop/co3d.py compares the numbers.
#include "data/co3d_prepare.h"

#include <gtest/gtest.h>

#include <atomic>

#include "core/path_name.h"
#include "data/co3d_cameras.h"
#include "data/co3d_image.h"
#include "data/sample_formats.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/folder.h"
#include "support/expect_status.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

std::string frame_text(int number, const std::string& more = "") {
    return format(R"({"sequence_name": "1_2_3", "frame_number": %d, "frame_timestamp": 0.%d,
        "image": {"path": "hydrant/1_2_3/%d.png", "size": [16, 16]},
        "mask": {"path": "hydrant/1_2_3/m%d.png", "bounding_box_xywh": [4, 4, 6, 6]},
        "viewpoint": {"R": [[1,0,0],[0,1,0],[0,0,1]], "T": [%d,0,5], "focal_length": [2,3],
                      "principal_point": [0,0.25], "intrinsics_format": "ndc_isotropic"%s}})",
                  number, 9 - number, number, number, number, more.c_str());
}

void put_gzip(const fs::path& path, const std::string& text) {
    ASSERT_OK(io::write_file(path.string(), need(io::gzip(io::as_bytes(text)))));
}

class Co3dPrepare : public testing::Test {
  protected:
    void SetUp() override {
        desc_.raw = folder_.path().string();
        desc_.out = (folder_ / "out").string();
        desc_.category = "hydrant";
        desc_.size = 8;
        for (int i = 0; i < 2; ++i) {
            put_image(raw_ / "1_2_3" / (std::to_string(i) + ".png"), 16, 3);
            put_image(raw_ / "1_2_3" / ("m" + std::to_string(i) + ".png"), 16, 1);
        }
        put_text(raw_ / "1_2_3/pointcloud.ply",
                 "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                 "property float z\nend_header\n0 0 0\n1 2 0.5\n");
        put_text(raw_ / "set_lists/set_lists_fewview_dev.json",
                 R"({"val": [], "train": [["1_2_3", 1, "x"], ["1_2_3", 0, "y"]]})");
        put_gzip(raw_ / "frame_annotations.jgz", "[" + frame_text(0) + ", " + frame_text(1) + "]");
        put_gzip(
            raw_ / "sequence_annotations.jgz",
            R"([{"sequence_name": "1_2_3", "point_cloud": {"path": "hydrant/1_2_3/pointcloud.ply"}}])");
    }

    Result<Co3dPrepared> prepare() {
        return prepare_co3d(desc_, [this](std::size_t, std::size_t) { ++calls_; });
    }

    void expect_refused(Code code, const char* part) {
        fs::remove_all(desc_.out);
        EXPECT_ERROR(prepare(), code, part);
        EXPECT_FALSE(fs::exists(fs::path(desc_.out) / "co3d_hydrant_for_gs/train/1_2_3"));
    }

    SampleFolder folder_;
    fs::path raw_ = folder_ / "hydrant";
    Co3dPreparation desc_;
    std::atomic<int> calls_{0};
};

TEST_F(Co3dPrepare, WritesADataSet) {
    const auto made = need(prepare());
    EXPECT_EQ(made.sequences, 1U);
    EXPECT_EQ(made.frames, 2U);
    EXPECT_EQ(made.kept, 0U);
    EXPECT_EQ(calls_, 1);
    const fs::path split = fs::path(desc_.out) / "co3d_hydrant_for_gs/train";
    EXPECT_EQ(file_text(split / "1_2_3/frame_order.txt"), "00000.png\n00001.png\n")
        << "frame 1 comes first: it is earlier, and first in the list";
    const auto dataset = open_data(desc_.out);
    EXPECT_EQ(dataset->index().maps, flag_of(MapKind::kMask));
    EXPECT_EQ(dataset->resolution(), 8U);
    std::vector<float> focals(4);
    const std::uint32_t views[] = {0, 1};
    ASSERT_OK(dataset->read(0, views, {.focals = focals.data()}));
    // 16 and 24 pixels; half of the largest square around (8, 6) is 6, so 16 / 6 of the half side 4.
    EXPECT_NEAR(focals[0], 16.0 / 6 * 4, 1e-5);
    EXPECT_NEAR(focals[1], 24.0 / 6 * 4, 1e-5);
    EXPECT_EQ(prepare().value().kept, 1U);
}

/// A call with a limit, after one of all, leaves the cameras of all.
TEST_F(Co3dPrepare, KeepsCamerasOfEarlierCalls) {
    ASSERT_OK(prepare());
    const fs::path split = fs::path(desc_.out) / "co3d_hydrant_for_gs/train";
    fs::copy(split / "1_2_3", split / "4_5_6", fs::copy_options::recursive);
    ASSERT_OK(prepare());
    const auto dataset = open_data(desc_.out);
    EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"1_2_3", "4_5_6"}));
    EXPECT_OK(dataset->read_cameras());
}

TEST_F(Co3dPrepare, RefusesAFolderOfOtherValues) {
    ASSERT_OK(prepare());
    const auto refused = [this](const Co3dPreparation& other, const char* part) {
        EXPECT_ERROR(prepare_co3d(other, [](std::size_t, std::size_t) {}), Code::kInvalidArgument,
                     part);
    };
    Co3dPreparation other = desc_;
    other.size = 16;
    refused(other, "\"size\": 8");
    other = desc_;
    other.stored_poses = true;
    refused(other, "made with other values");
    fs::remove(fs::path(desc_.out) / "co3d_hydrant_for_gs/train/prepared.json");
    refused(desc_, "no prepared.json");
}

/// A sequence's name is text of an annotation.
TEST_F(Co3dPrepare, NamesLeadNowhereElse) {
    const auto renamed = [](std::string text, const std::string& from, const std::string& to) {
        for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
            text.replace(at, from.size(), to);
        return text;
    };
    for (const std::string name : {"../../../../ESCAPED", "/tmp/ESCAPED", ".."}) {
        const auto renaming = [&](const std::string& text) {
            return renamed(text, "\"1_2_3\"", "\"" + name + "\"");
        };
        put_text(raw_ / "set_lists/set_lists_fewview_dev.json",
                 renaming(R"({"val": [], "train": [["1_2_3", 1, "x"], ["1_2_3", 0, "y"]]})"));
        put_gzip(raw_ / "frame_annotations.jgz",
                 renaming("[" + frame_text(0) + ", " + frame_text(1) + "]"));
        put_gzip(raw_ / "sequence_annotations.jgz", renaming(R"([{"sequence_name": "1_2_3",
            "point_cloud": {"path": "hydrant/1_2_3/pointcloud.ply"}}])"));
        fs::remove_all(desc_.out);
        ASSERT_OK(prepare());
        EXPECT_TRUE(fs::exists(fs::path(desc_.out) / "co3d_hydrant_for_gs/train" / PathName(name)));
        EXPECT_EQ(open_data(desc_.out)->index().names,
                  std::vector<std::string>{PathName(name).text()});
        EXPECT_EQ(io::entries_in(folder_.path().string()).value().size(), 2U) << "in and out";
    }
    SetUp();
    put_gzip(raw_ / "frame_annotations.jgz",
             "[" + renamed(frame_text(0), "hydrant/1_2_3/0.png", "../secret.png") + "]");
    expect_refused(Code::kFormat, "the path '../secret.png', expected one below");
}

TEST_F(Co3dPrepare, RefusesWrongRequests) {
    desc_.split = "all";
    expect_refused(Code::kInvalidArgument, "split is 'all'");
    desc_.split = "test";
    expect_refused(Code::kFormat, "has no list 'test'");
    desc_.split = "train";
    desc_.size = 0;
    expect_refused(Code::kInvalidArgument, "size is 0");
    desc_.size = 8;
    desc_.category = "../x";
    expect_refused(Code::kInvalidArgument, "category is '../x'");
    desc_.category = "none";
    expect_refused(Code::kNotFound, "set_lists_fewview_dev.json");
}

TEST_F(Co3dPrepare, RefusesDamagedAnnotations) {
    const fs::path frames = raw_ / "frame_annotations.jgz";
    const auto refused = [&](const std::string& text, const char* part) {
        put_gzip(frames, text);
        expect_refused(Code::kFormat, part);
    };
    refused("[" + frame_text(0), "no JSON array");
    refused("{}", "no JSON array: byte 0");
    refused("[" + frame_text(0) + "]", "has 1 of the 2 frames of the split 'train'");
    refused("[}]", "no JSON array: byte 1");
    refused("[" + frame_text(0) + ", {\"sequence_name\": 3}]", "without a valid 'sequence_name'");
    std::string other = frame_text(1);
    other.replace(other.find("isotropic"), 9, "of_mars__");
    refused("[" + frame_text(0) + "," + other + "]",
            "1_2_3, frame 1': the intrinsics_format 'ndc_of_mars__'");
    other = frame_text(1);
    other.replace(other.find("[1,0,0]"), 7, "[1,0,x]");
    refused("[" + other + "]", "frame_annotations.jgz': byte 1: element");
    other = frame_text(1);
    other.replace(other.find("[1,0,0]"), 7, "[1,0]  ");
    refused("[" + other + "]", "without a valid 'viewpoint.R'");
    other = frame_text(1);
    other.replace(other.find("\"frame_number\": 1"), 17, "\"frame_number\": 1e30");
    refused("[" + other + "]", "without a valid 'frame_number'");
    put_text(frames, "\x1f\x8b no gzip");
    expect_refused(Code::kFormat, "frame_annotations.jgz'");
    put_text(raw_ / "set_lists/set_lists_fewview_dev.json", R"({"train": [["1_2_3"]]})");
    expect_refused(Code::kFormat, "element 0 is not [sequence, frame number, path]");
}

TEST_F(Co3dPrepare, RefusesAnnotationsThatUnpackToMuch) {
    put_gzip(raw_ / "frame_annotations.jgz", "[" + std::string(80'000'000, ' ') + "]");
    expect_refused(Code::kFormat, "80000002 x 1 bytes are too many for a file of");
}

/// The tree of an element takes far more memory than its text.
TEST_F(Co3dPrepare, RefusesElementsOfManyValues) {
    std::string element = "[0";
    for (int i = 0; i < 1'000'000; ++i) element += ",0";
    put_gzip(raw_ / "frame_annotations.jgz", "[" + element + "]]");
    expect_refused(Code::kFormat, "JSON values: 1000001 x ");
    put_text(raw_ / "frame_annotations.jgz", "[" + element + "]]");
    expect_refused(Code::kFormat, "without a valid 'sequence_name'");
}

TEST_F(Co3dPrepare, RefusesMissingAndOtherFiles) {
    put_image(raw_ / "1_2_3/m1.png", 8, 1);
    expect_refused(Code::kFormat, "m1.png': 8 x 8 pixels, its annotation has 16 x 16");
    fs::remove(raw_ / "1_2_3/m1.png");
    expect_refused(Code::kNotFound, "m1.png");
    put_image(raw_ / "1_2_3/m1.png", 16, 1);
    put_image(raw_ / "1_2_3/1.png", 16, 1);
    expect_refused(Code::kFormat, "1.png': an image without colours");
    put_image(raw_ / "1_2_3/1.png", 16, 3);
    put_text(raw_ / "1_2_3/pointcloud.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n");
    expect_refused(Code::kFormat, "pointcloud.ply' has no vertices with x, y and z");
    put_gzip(raw_ / "sequence_annotations.jgz", "[]");
    expect_refused(Code::kFormat, "has no sequence '1_2_3'");
}

TEST(Co3dImage, RefusesBoxesAndPointsOutside) {
    EXPECT_OK(crop_box({2, 2, 4, 4}, 16, 16));
    EXPECT_ERROR(crop_box({2, 2, 0.5F, 4}, 16, 16), Code::kFormat, "more than a pixel");
    EXPECT_ERROR(crop_box({20, 2, 4, 4}, 16, 16), Code::kFormat, "outside the image");
    EXPECT_ERROR(principal_square({-1, 8}, 16, 16), Code::kFormat, "not inside");
}

TEST(Co3dImage, EmptyMasksGiveTheWholeImage) {
    Planes mask{6, 4, 1, std::vector<float>(24)};
    EXPECT_EQ(foreground_box(mask), (std::array<float, 4>{0, 0, 6, 4}));
    mask.values[7] = mask.values[14] = 0.2F;
    EXPECT_EQ(foreground_box(mask), (std::array<float, 4>{1, 1, 2, 2})) << "above 0.15";
}

}  // namespace
}  // namespace splat::data
