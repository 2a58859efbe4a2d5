// Maps and masks of every format.
#include <gtest/gtest.h>

#include "data/dataset_check.h"
#include "data/sample_formats.h"
#include "io/file.h"
#include "support/expect_status.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using test::data_desc;
using test::kPose;
using test::numbered;
using test::open_data;
using test::put_image;
using test::put_text;
using test::SampleFolder;

struct ReadMaps {
    std::vector<float> images, depths, normals, masks;
};

/// All views of the first object.
ReadMaps read_maps(Dataset& dataset, bool depths = true) {
    const std::size_t n = dataset.index().views_of[0];
    const std::size_t area = n * dataset.resolution() * dataset.resolution();
    std::vector<std::uint32_t> views(n);
    for (std::uint32_t i = 0; i < n; ++i) views[i] = i;
    ReadMaps maps{std::vector<float>(3 * area), std::vector<float>(area),
                  std::vector<float>(3 * area), std::vector<float>(area)};
    ViewArrays out;
    out.images = maps.images.data();
    out.masks = maps.masks.data();
    if (depths) {
        out.depths = maps.depths.data();
        out.normals = maps.normals.data();
    }
    EXPECT_OK(dataset.read(0, views, out));
    return maps;
}

/// Maps of two views of 8 x 8 pixels: sample i of depth, normal and mask starts at 30, 60 and 90.
void put_maps(const fs::path& object, const std::vector<std::string>& stems) {
    for (std::uint32_t view = 0; view < stems.size(); ++view) {
        put_image(object / "depth" / (stems[view] + ".png"), 8, 1, 30 + view);
        put_image(object / "normal" / (stems[view] + ".png"), 8, 3, 60 + view);
        put_image(object / "mask" / (stems[view] + ".png"), 8, 1, 90 + view);
    }
}

void expect_maps(const fs::path& root, const std::string& split = "train") {
    const auto dataset = open_data(root, split);
    ASSERT_NE(dataset, nullptr);
    EXPECT_EQ(dataset->index().maps, kAllMaps);
    EXPECT_FALSE(dataset->index().alpha_masks);
    const ReadMaps maps = read_maps(*dataset);
    EXPECT_EQ(maps.depths[0], 30.0F / 255);
    EXPECT_EQ(maps.depths[64 + 9], 51.0F / 255) << "view 1, row 1, column 1";
    EXPECT_EQ(maps.normals[64], 61.0F / 255) << "channel 1";
    EXPECT_EQ(maps.masks[64], 91.0F / 255);
    const auto checked = check_object(*dataset, 0);
    ASSERT_OK(checked.status());
    EXPECT_TRUE(checked.value().problems.empty());
}

std::vector<float> twice(const std::vector<float>& pose) {
    std::vector<float> poses = pose;
    poses.insert(poses.end(), pose.begin(), pose.end());
    poses[15] += 1;
    return poses;
}

TEST(Maps, OfNmr) {
    const SampleFolder folder;
    test::put_nmr(folder.path(), twice(kPose), 12);
    EXPECT_EQ(open_data(folder.path())->index().maps, 0U) << "images without alpha";
    put_maps(folder.path() / "02691156/b", {"000", "001"});
    expect_maps(folder.path());
    fs::remove(folder.path() / "02691156/b/normal/001.png");
    EXPECT_ERROR(test::data_status(folder.path()), Code::kFormat,
                 "1 images in normal; poses without image: 1 (first '001')");
}

TEST(Maps, OfObjaverseAndGso) {
    for (const bool gso : {false, true}) {
        const SampleFolder folder;
        const fs::path object = folder.path() / (gso ? "a/render_mvs_25/model" : "a");
        test::put_renders(object, twice(kPose));
        test::put_renders(folder.path() / (gso ? "b/render_mvs_25/model" : "b"), twice(kPose));
        put_maps(object, {"000", "001"});
        const std::string split = gso ? "test" : "train";
        if (!gso) {
            expect_maps(folder.path(), split);
            continue;
        }
        const auto dataset = open_data(folder.path(), split);
        EXPECT_EQ(dataset->index().maps, flag_of(MapKind::kMask)) << "b has only its alpha";
        EXPECT_TRUE(dataset->index().alpha_masks);
        put_maps(folder.path() / "b/render_mvs_25/model", {"000", "001"});
        expect_maps(folder.path(), split);
    }
}

TEST(Maps, OfCo3d) {
    const SampleFolder folder;
    test::Co3dSample sample;
    sample.r = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    sample.t = {0, 0, 3, 0, 0, 4};
    sample.focal = {2, 2, 2, 2};
    sample.images.assign(2 * 3 * 64, 0.2F);
    test::put_co3d(folder.path(), sample);
    const fs::path sequence = folder.path() / "co3d_hydrant_for_gs/train/106_1_2";
    EXPECT_EQ(open_data(folder.path())->index().maps, 0U);
    std::vector<float> plane(128, 0.2F);
    plane[64] = 0.6F;
    test::put_npy(sequence / "masks.npy", {2, 1, 8, 8}, plane);
    test::put_npy(sequence / "normals.npy", {2, 3, 8, 8}, std::vector<float>(384, 0.4F));
    const auto masked = open_data(folder.path());
    EXPECT_EQ(masked->index().maps, flag_of(MapKind::kMask) | flag_of(MapKind::kNormal));
    EXPECT_EQ(read_maps(*masked, false).masks[64], 153.0F / 255);
    test::put_npy(sequence / "depths.npy", {2, 1, 8, 8}, plane);
    const auto all = open_data(folder.path());
    EXPECT_EQ(all->index().maps, kAllMaps);
    EXPECT_EQ(read_maps(*all).depths[0], 51.0F / 255);
    EXPECT_EQ(read_maps(*all).normals[0], 102.0F / 255);
    test::put_npy(sequence / "depths.npy", {3, 1, 8, 8}, std::vector<float>(192));
    EXPECT_ERROR(test::data_status(folder.path()), Code::kFormat,
                 "depths.npy': 3 frames, expected 2 as the images");
    test::put_npy(sequence / "depths.npy", {2, 3, 8, 8}, std::vector<float>(384));
    EXPECT_ERROR(test::data_status(folder.path()), Code::kFormat,
                 "depths.npy': expected float32 [frames,1,side,side]");
}

constexpr const char* kCamera = R"({"fl_x": 10, "cx": 4, "cy": 4, "w": 8, "h": 8, "frames": [
    {"file_path": "images/a.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]},
    {"file_path": "images/b.png", "transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]})";

TEST(Maps, OfPhotographs) {
    const SampleFolder folder;
    put_text(folder.path() / "scene/transforms.json", kCamera);
    for (const char* name : {"a", "b"})
        put_image(folder.path() / "scene/images" / (std::string(name) + ".png"), 8, 3);
    put_maps(folder.path() / "scene", {"a", "b"});
    expect_maps(folder.path());
    put_image(folder.path() / "scene/mask/a.png", 4, 1);
    const auto dataset = open_data(folder.path());
    std::vector<float> mask(64);
    ViewArrays out;
    out.masks = mask.data();
    const std::uint32_t view = 0;
    EXPECT_ERROR(dataset->read(0, std::span(&view, 1), out), Code::kFormat,
                 "mask/a.png': 4 x 4 pixels, its camera has 8 x 8");
}

TEST(Maps, OfSrnInOtherImageFormats) {
    const SampleFolder folder;
    const fs::path object = folder.path() / "a_train/o";
    put_text(object / "intrinsics.txt", "10. 4. 4. 0.\n0. 0. 0.\n1.\n8 8\n");
    for (const char* stem : {"0", "1"}) {
        put_text(object / "pose" / (std::string(stem) + ".txt"),
                 "1 0 0 0 0 1 0 0 0 0 1 -2 0 0 0 1");
        put_image(object / "rgb" / (std::string(stem) + ".png"), 8, 4, 0, 51);
    }
    const auto alpha = open_data(folder.path());
    ASSERT_NE(alpha, nullptr);
    EXPECT_EQ(alpha->index().maps, flag_of(MapKind::kMask));
    const ReadMaps maps = read_maps(*alpha, false);
    EXPECT_EQ(maps.masks[0], 51.0F / 255) << "the alpha of rgb";
    EXPECT_EQ(maps.images[9], 20.0F / 255) << "colours as stored, not composited on black";
    put_maps(object, {"0", "1"});
    expect_maps(folder.path());
    fs::rename(object / "mask/0.png", object / "mask/0.PNG");
    expect_maps(folder.path());
}

TEST(Maps, AlphaIsTheMask) {
    const SampleFolder folder;
    const fs::path object = folder.path() / "a";
    test::put_renders(object, twice(kPose));
    test::put_renders(folder.path() / "b", twice(kPose));
    put_image(object / "000.png", 8, 4, 0, 102);
    DatasetDesc desc = data_desc(folder.path());
    desc.maps = flag_of(MapKind::kMask);
    desc.background = {1, 1, 1};
    const auto dataset = open_data(desc);
    ASSERT_NE(dataset, nullptr);
    const ReadMaps maps = read_maps(*dataset, false);
    EXPECT_EQ(maps.masks[0], 0.4F);
    EXPECT_EQ(maps.masks[64], 1.0F);
    EXPECT_EQ(maps.images[0], 153.0F / 255) << "0 of 255 on white";
    put_image(object / "001.png", 8, 3);
    const std::uint32_t views[] = {0, 1};
    std::vector<float> masks(128);
    ViewArrays out;
    out.masks = masks.data();
    EXPECT_ERROR(open_data(desc)->read(0, views, out), Code::kFormat,
                 "object 'a', view 1: an image without alpha");
    desc.maps = flag_of(MapKind::kDepth);
    EXPECT_ERROR(Dataset::open(desc).status(), Code::kNotFound,
                 "maps requested: depth; every object has: mask");
}

}  // namespace
}  // namespace splat::data
