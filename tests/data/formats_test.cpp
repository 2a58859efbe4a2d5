// Folders of each format, written here: with cameras of another implementation, and damaged.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "data/sample_formats.h"
#include "support/expect_status.h"
#include "support/golden_file.h"
#include "support/log_capture.h"
#include "synthetic/sample_folder.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

struct Cameras {
    std::vector<float> poses, quaternions, focals, distances;
};

Cameras cameras_of(Dataset& dataset) {
    std::vector<std::uint32_t> views(dataset.index().views_of[0]);
    for (std::uint32_t i = 0; i < views.size(); ++i) views[i] = i;
    const std::size_t n = views.size();
    Cameras c{std::vector<float>(n * 16), std::vector<float>(n * 4), std::vector<float>(n * 2),
              std::vector<float>(n)};
    ViewArrays out{.view_to_world = c.poses.data(),
                   .quaternions = c.quaternions.data(),
                   .focals = c.focals.data(),
                   .origin_distances = c.distances.data()};
    EXPECT_OK(dataset.read(0, views, out));
    return c;
}

TEST(Objaverse, SplitsItsObjectsAndScalesThem) {
    const SampleFolder folder;
    std::vector<float> poses = twice(kPose);
    poses[12 + 3] = 1;
    for (int i = 0; i < 3; ++i) put_renders(folder / ("o" + std::to_string(i)), poses);
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().format, "objaverse");
    EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"o0", "o1"}))
        << "99 of 100, rounded down";
    EXPECT_EQ(open_data(folder.path(), "val")->index().names, (std::vector<std::string>{"o2"}));
    EXPECT_ERROR(data_status(folder.path(), "test"), Code::kNotFound, "no split 'test'");
    const Cameras c = cameras_of(*dataset);
    EXPECT_EQ(c.focals[0], 8.75F);
    EXPECT_EQ(c.poses[16 + 12], -1) << "one to the left; the first camera is 2 away already";
    put_npy(folder / "o0/001.npy", {3, 3}, std::vector<float>(9));
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "001.npy': a pose of 9 numbers");
    fs::remove(folder / "o0/001.npy");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "images without pose: 1 (first '001')");
}

TEST(Gso, IsAllToTestOn) {
    const SampleFolder folder;
    put_renders(folder / "shoe/render_mvs_25/model", twice(kPose));
    const auto dataset = open_data(folder.path(), "test");
    EXPECT_EQ(dataset->index().format, "gso");
    EXPECT_ERROR(data_status(folder.path()), Code::kNotFound, "it is for evaluation only");
    EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"shoe"}));
}

TEST(Nmr, ReadsListsAndCameras) {
    const SampleFolder folder;
    put_nmr(folder.path(), twice(kPose), 12);
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().format, "nmr");
    EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"02691156_b"}));
    EXPECT_NEAR(cameras_of(*dataset).focals[0], 3.7320509 * 4, 1e-5);
    EXPECT_ERROR(data_status(folder.path(), "val"), Code::kNotFound, "softras_val.lst");
    put_npz(folder / "02691156/b/cameras.npz",
            {{"world_mat_0", kPose}, {"world_mat_inv_1", kPose}});
    EXPECT_OK(data_status(folder.path()));
    put_npz(folder / "02691156/b/cameras.npz", {{"world_mat_0", kPose}});
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "neither world_mat_inv_1 nor world_mat_1");
    put_npz(folder / "02691156/b/cameras.npz",
            {{"world_mat_0", kPose}, {"world_mat_1", kPose}, {"camera_mat_1", {2}}});
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "camera_mat_1 has the focal length 2");
    put_npz(folder / "02691156/b/cameras.npz",
            {{"world_mat_0", kPose},
             {"world_mat_1", kPose},
             {"camera_mat_1", {3.7320509F, 0, 0, 0, 3, 0, 0, 0, 1}}});
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "has the focal length 3");
}

TEST(Co3d, ReadsArrays) {
    const SampleFolder folder;
    Co3dSample sample{.r = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, -1, 0, 0, 0, 0, 1},
                      .t = {0, 0, 3, 0, 0, 4},
                      .focal = {2, 2.5F, 3, 3}};
    sample.images[3 * 64 + 64] = 1;
    put_co3d(folder.path(), sample);
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().format, "co3d");
    const Cameras c = cameras_of(*dataset);
    EXPECT_EQ(c.focals, (std::vector<float>{8, 10, 12, 12}));
    EXPECT_EQ(c.distances, (std::vector<float>{3, 4}));
    std::vector<float> images(2 * 3 * 64);
    const std::uint32_t views[] = {0, 1};
    ASSERT_OK(dataset->read(0, views, {.images = images.data()}));
    EXPECT_EQ(images[3 * 64 + 64], 1);
    EXPECT_EQ(images[0], 51.0F / 255);
    for (const float focal :
         {0.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        put_npy(folder / "co3d_hydrant_for_gs/train/106_1_2/focal_lengths.npy", {2, 1, 2},
                std::vector<float>{2, 2.5F, focal, 3});
        EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "frame 1 has the focal length");
    }
    put_co3d(folder.path(), sample);
    put_npz(folder / "co3d_hydrant_for_gs/train/camera_Ts.npz", {{"106_1_2", {0, 0, 3}}});
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "2 frames, but 2 rotations, 1 translations and 2 focal");
    put_npy(folder / "co3d_hydrant_for_gs/train/106_1_2/images_fg.npy", {2, 1, 8, 8},
            std::vector<float>(128));
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "images_fg.npy': expected float32");
    EXPECT_ERROR(data_status(folder.path(), "val"), Code::kNotFound, "0 files val/camera_Rs.npz");
    fs::remove(folder / "co3d_hydrant_for_gs/train/camera_Ts.npz");
    bool lacks = false;
    DatasetDesc desc = data_desc(folder.path());
    desc.lacks_split = &lacks;
    EXPECT_ERROR(Dataset::open(desc), Code::kFormat, "camera_Ts.npz");
    EXPECT_FALSE(lacks) << "the split is there, but damaged";
    desc.split = "val";
    EXPECT_EQ(Dataset::open(desc).status().code(), Code::kNotFound);
    EXPECT_TRUE(lacks);
}

const std::string kFrames =
    two_frames(R"("fl_x": 10, "cx": 6, "cy": 5, "w": 12, "h": 10)", "./images/b", "images/a.png");

void put_photo(const fs::path& path) {
    io::Image image{12, 10, 3, 8, {}};
    for (std::uint16_t i = 0; i < 360; ++i) image.samples.push_back(i % 36 / 3 * 20);
    put_png(path, image);
}

TEST(ImageFolder, TakesTheSquareAroundThePrincipalPoint) {
    const SampleFolder folder;
    put_text(folder / "scene/transforms.json", kFrames);
    put_photo(folder / "scene/images/a.png");
    put_photo(folder / "scene/images/b.png");
    for (const fs::path& path : {folder.path(), folder / "scene"}) {
        const auto dataset = open_data(path);
        EXPECT_EQ(dataset->index().format, "images");
        EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"scene"}));
        EXPECT_EQ(dataset->resolution(), 10U);
        const Cameras c = cameras_of(*dataset);
        EXPECT_EQ(c.focals[0], 10);
        EXPECT_EQ(c.poses[16 + 12], 1) << "b is first, a is one to its right"
                                       << " (sorted as './images/b', 'images/a.png')";
        std::vector<float> images(300);
        const std::uint32_t view = 0;
        ASSERT_OK(dataset->read(0, std::span(&view, 1), {.images = images.data()}));
        EXPECT_EQ(images[0], 20.0F / 255) << "column 1 of the photograph";
        EXPECT_EQ(images[9], 200.0F / 255);
    }
    fs::remove(folder / "scene/images/b.png");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "no image './images/b'");
    put_image(folder / "scene/images/b.png", 8, 3);
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "its camera has 12 x 10");
}

TEST(ImageFolder, KnowsWhetherItHasSplits) {
    const SampleFolder folder;
    const fs::path scene = folder / "scene";
    put_text(scene / "transforms.json", kFrames);
    put_photo(scene / "images/a.png");
    put_photo(scene / "images/b.png");
    for (const fs::path& path : {folder.path(), scene, scene / "", scene / "images" / ".."}) {
        const auto dataset = open_data(path, "test");
        EXPECT_FALSE(dataset->index().has_splits);
        EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"scene"})) << path;
    }
    fs::rename(scene / "transforms.json", scene / "transforms_train.json");
    EXPECT_TRUE(open_data(folder.path())->index().has_splits);
    bool lacks = false;
    DatasetDesc desc = data_desc(folder.path(), "val");
    desc.lacks_split = &lacks;
    EXPECT_ERROR(Dataset::open(desc), Code::kNotFound,
                 "holds neither transforms.json nor transforms_val.json nor a COLMAP model");
    EXPECT_TRUE(lacks);
    fs::rename(scene / "transforms_train.json", scene / "transforms.json");
    fs::create_directory(folder / "train");
    fs::rename(scene, folder / "train/scene");
    EXPECT_TRUE(open_data(folder.path())->index().has_splits);
    EXPECT_ERROR(data_status(folder.path(), "val"), Code::kNotFound, "holds neither");
}

TEST(ImageFolder, WarnsOfObjectsWithoutTheSplitOfOthers) {
    const SampleFolder folder;
    for (const char* name : {"one", "other"}) {
        put_text(folder / name / "transforms.json", kFrames);
        put_text(folder / name / "transforms_val.json", kFrames);
        put_photo(folder / name / "images/a.png");
        put_photo(folder / name / "images/b.png");
    }
    const LogCapture log;
    EXPECT_TRUE(open_data(folder.path(), "val")->index().has_splits);
    EXPECT_LACKS(log.text(), "which other objects have");
    fs::remove(folder / "other/transforms_val.json");
    EXPECT_FALSE(open_data(folder.path(), "val")->index().has_splits);
    EXPECT_HAS(log.text(), "other' has no transforms_val.json, which other objects have");
}

TEST(ImageFolder, ReadsColmapModels) {
    const SampleFolder folder;
    put_text(folder / "sparse/0/cameras.txt", "1 PINHOLE 12 10 10 11 6 5\n");
    put_text(folder / "sparse/0/images.txt",
             "1 1 0 0 0 0 0 4 1 a.png\n\n2 1 0 0 0 -1 0 4 1 b.png\n\n");
    put_photo(folder / "images/a.png");
    put_photo(folder / "images/b.png");
    const auto dataset = open_data(folder.path());
    const Cameras c = cameras_of(*dataset);
    EXPECT_EQ(c.focals, (std::vector<float>{10, 11, 10, 11}));
    EXPECT_EQ(c.poses[16 + 12], 1);
}

class GoldenNetFormats : public testing::Test {
  protected:
    void SetUp() override { SPLAT_NEEDS_GOLDEN_FOLDER(); }

    /// Relative poses, quaternions and centres of all files of the family against those of a folder that
    /// `put` makes of the file's arrays.
    static void compare(const std::string& set,
                        const std::function<void(const Golden& file, const fs::path& root)>& put) {
        each_golden("cams", [&](const Golden& golden) {
            const SampleFolder folder;
            put(golden, folder.path());
            const auto dataset = open_data(folder.path());
            const Cameras found = cameras_of(*dataset);
            const std::vector<float> poses = array(golden, set + ".rel_vw");
            ASSERT_EQ(found.poses.size(), poses.size());
            // 2e-5: float32 inverses of the reference, with translations up to 4, some of them
            // scaled.
            for (std::size_t i = 0; i < poses.size(); ++i)
                EXPECT_NEAR(found.poses[i], poses[i], 2e-5) << set << " " << i;
            if (set != "co3d") return;
            const std::vector<float> distances = array(golden, "co3d.origin_dist");
            const std::vector<float> focals = array(golden, "co3d.focal_px");
            for (std::size_t i = 0; i < distances.size(); ++i)
                EXPECT_NEAR(found.distances[i], distances[i], 1e-5);
            for (std::size_t i = 0; i < focals.size(); ++i)  // for 128 pixels; here there are 8
                EXPECT_NEAR(found.focals[i], static_cast<double>(focals[i]) / 16, 1e-5);
        });
    }

    static std::vector<float> array(const Golden& file, const std::string& name) {
        const std::vector<double> values = file.doubles(name);
        return {values.begin(), values.end()};
    }
};

TEST_F(GoldenNetFormats, SrnGivesTheReferencesCameras) {
    compare("srn", [](const Golden& file, const fs::path& root) {
        const std::vector<float> poses = array(file, "srn.c2w");
        const fs::path object = root / "srn_cars/cars_train/a";
        put_text(object / "intrinsics.txt", "131.25 64 64 0\n0 0 0\n1\n128 128\n");
        for (std::size_t i = 0; i < poses.size() / 16; ++i) {
            std::string text;
            for (std::size_t k = 0; k < 16; ++k)
                text += format("%.9g ", static_cast<double>(poses[i * 16 + k]));
            put_text(object / "pose" / (numbered(i) + ".txt"), text);
            put_image(object / "rgb" / (numbered(i) + ".png"), 8, 3);
        }
    });
}

TEST_F(GoldenNetFormats, Co3dGivesTheReferencesCameras) {
    compare("co3d", [](const Golden& file, const fs::path& root) {
        put_co3d(root,
                 {array(file, "co3d.R"), array(file, "co3d.T"), array(file, "co3d.focal_ndc")});
    });
}

TEST_F(GoldenNetFormats, NmrGivesTheReferencesCameras) {
    compare("nmr", [](const Golden& file, const fs::path& root) {
        put_nmr(root, array(file, "nmr.world_mat_inv"), 16);
    });
}

TEST_F(GoldenNetFormats, ObjaverseGivesTheReferencesCameras) {
    compare("obj", [](const Golden& file, const fs::path& root) {
        put_renders(root / "a", array(file, "obj.w2c"));
        put_renders(root / "b", array(file, "obj.w2c"));
    });
}

}  // namespace
}  // namespace splat::data
