// Maps and masks of every format.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data/dataset_check.h"
#include "data/sample_formats.h"
#include "io/file.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

struct ReadMaps {
    std::vector<float> images, depths, normals, masks, planes;
};

/// All views of the first object.
ReadMaps read_maps(Dataset& dataset, bool depths = true) {
    const std::size_t n = dataset.index().views_of[0];
    const std::size_t area = n * dataset.resolution() * dataset.resolution();
    std::vector<std::uint32_t> views(n);
    for (std::uint32_t i = 0; i < n; ++i) views[i] = i;
    ReadMaps maps{std::vector<float>(3 * area),
                  std::vector<float>(area),
                  std::vector<float>(3 * area),
                  std::vector<float>(area),
                  {}};
    ViewArrays out{.images = maps.images.data(), .masks = maps.masks.data()};
    if (depths) {
        out.depths = maps.depths.data();
        out.normals = maps.normals.data();
    }
    if ((dataset.index().maps & flag_of(MapKind::kPlane)) != 0) {
        maps.planes.resize(5 * area);
        out.planes = maps.planes.data();
    }
    EXPECT_OK(dataset.read(0, views, out));
    return maps;
}

/// Maps of two views of 8 x 8 pixels: sample i of depth, normal, mask and plane starts at 30, 60, 90 and 170; planes
/// have the distance 200.
void put_maps(const fs::path& object, const std::vector<std::string>& stems) {
    for (std::uint32_t view = 0; view < stems.size(); ++view) {
        put_image(object / "depth" / (stems[view] + ".png"), 8, 1, 30 + view);
        put_image(object / "normal" / (stems[view] + ".png"), 8, 3, 60 + view);
        put_image(object / "mask" / (stems[view] + ".png"), 8, 1, 90 + view);
        put_image(object / "plane" / (stems[view] + ".png"), 8, 4, 170 + view, 200);
    }
}

void expect_maps(const fs::path& root, const std::string& split = "train") {
    const auto dataset = open_data(root, split);
    EXPECT_EQ(dataset->index().maps, kAllMaps);
    EXPECT_FALSE(dataset->index().alpha_masks);
    const ReadMaps maps = read_maps(*dataset);
    EXPECT_EQ(maps.depths[0], 30.0F / 255);
    EXPECT_EQ(maps.depths[64 + 9], 51.0F / 255) << "view 1, row 1, column 1";
    EXPECT_EQ(maps.normals[64], 61.0F / 255) << "channel 1";
    EXPECT_EQ(maps.masks[64], 91.0F / 255);
    EXPECT_EQ(maps.planes[64], 171.0F / 255) << "normal y, over no background";
    EXPECT_EQ(maps.planes[3 * 64 + 5], 200.0F / 255) << "distance";
    EXPECT_EQ(maps.planes[5 * 64], 171.0F / 255) << "view 1";
    EXPECT_TRUE(need(check_object(*dataset, 0)).problems.empty());
}

/// The second camera is one to the left.
std::vector<float> two_poses() {
    std::vector<float> poses = twice(kPose);
    poses[15] += 1;
    return poses;
}

TEST(Maps, OfNmr) {
    const SampleFolder folder;
    put_nmr(folder.path(), two_poses(), 12);
    EXPECT_EQ(open_data(folder.path())->index().maps, 0U) << "images without alpha";
    put_maps(folder / "02691156/b", {"000", "001"});
    expect_maps(folder.path());
    fs::remove(folder / "02691156/b/normal/001.png");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "1 images in normal; poses without image: 1 (first '001')");
}

TEST(Maps, OfObjaverseAndGso) {
    for (const bool gso : {false, true}) {
        const SampleFolder folder;
        const fs::path object = folder / (gso ? "a/render_mvs_25/model" : "a");
        put_renders(object, two_poses());
        put_renders(folder / (gso ? "b/render_mvs_25/model" : "b"), two_poses());
        put_maps(object, {"000", "001"});
        const std::string split = gso ? "test" : "train";
        if (!gso) {
            expect_maps(folder.path(), split);
            continue;
        }
        const auto dataset = open_data(folder.path(), split);
        EXPECT_EQ(dataset->index().maps, flag_of(MapKind::kMask)) << "b has only its alpha";
        EXPECT_TRUE(dataset->index().alpha_masks);
        put_maps(folder / "b/render_mvs_25/model", {"000", "001"});
        expect_maps(folder.path(), split);
    }
}

TEST(Maps, OfCo3d) {
    const SampleFolder folder;
    put_co3d(folder.path(), two_co3d_frames());
    const fs::path sequence = folder / "co3d_hydrant_for_gs/train/106_1_2";
    EXPECT_EQ(open_data(folder.path())->index().maps, 0U);
    std::vector<float> plane(128, 0.2F);
    plane[64] = 0.6F;
    put_npy(sequence / "masks.npy", {2, 1, 8, 8}, plane);
    put_npy(sequence / "normals.npy", {2, 3, 8, 8}, std::vector<float>(384, 0.4F));
    const auto masked = open_data(folder.path());
    EXPECT_EQ(masked->index().maps, flag_of(MapKind::kMask) | flag_of(MapKind::kNormal));
    EXPECT_EQ(read_maps(*masked, false).masks[64], 153.0F / 255);
    put_npy(sequence / "depths.npy", {2, 1, 8, 8}, plane);
    put_npy(sequence / "planes.npy", {2, 4, 8, 8}, std::vector<float>(512, 0.8F));
    const auto all = open_data(folder.path());
    EXPECT_EQ(all->index().maps, kAllMaps);
    EXPECT_EQ(read_maps(*all).depths[0], 51.0F / 255);
    EXPECT_EQ(read_maps(*all).normals[0], 102.0F / 255);
    EXPECT_EQ(read_maps(*all).planes[0], 204.0F / 255);
    EXPECT_EQ(read_maps(*all).planes[4 * 64], 1) << "one plane";
    put_npy(sequence / "depths.npy", {3, 1, 8, 8}, std::vector<float>(192));
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "depths.npy': 3 frames, expected 2 as the images");
    put_npy(sequence / "depths.npy", {2, 3, 8, 8}, std::vector<float>(384));
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "depths.npy': expected float32 [frames,1,side,side]");
}

const std::string kCamera =
    two_frames(R"("fl_x": 10, "cx": 4, "cy": 4, "w": 8, "h": 8)", "images/a.png", "images/b.png");

TEST(Maps, OfPhotographs) {
    const SampleFolder folder;
    put_text(folder / "scene/transforms.json", kCamera);
    for (const char* name : {"a", "b"})
        put_image(folder / "scene/images" / (std::string(name) + ".png"), 8, 3);
    put_maps(folder / "scene", {"a", "b"});
    expect_maps(folder.path());
    put_image(folder / "scene/mask/a.png", 4, 1);
    const auto dataset = open_data(folder.path());
    std::vector<float> mask(64);
    const std::uint32_t view = 0;
    EXPECT_ERROR(dataset->read(0, std::span(&view, 1), {.masks = mask.data()}), Code::kFormat,
                 "mask/a.png': 4 x 4 pixels, its camera has 8 x 8");
}

TEST(Maps, OfSrnInOtherImageFormats) {
    const SampleFolder folder;
    const fs::path object = folder / "a_train/o";
    put_text(object / "intrinsics.txt", "10. 4. 4. 0.\n0. 0. 0.\n1.\n8 8\n");
    for (const char* stem : {"0", "1"}) {
        put_text(object / "pose" / (std::string(stem) + ".txt"),
                 "1 0 0 0 0 1 0 0 0 0 1 -2 0 0 0 1");
        put_image(object / "rgb" / (std::string(stem) + ".png"), 8, 4, 0, 51);
    }
    const auto alpha = open_data(folder.path());
    EXPECT_EQ(alpha->index().maps, flag_of(MapKind::kMask));
    const ReadMaps maps = read_maps(*alpha, false);
    EXPECT_EQ(maps.masks[0], 51.0F / 255) << "the alpha of rgb";
    EXPECT_EQ(maps.images[9], 20.0F / 255) << "colours as stored, not composited on black";
    put_maps(object, {"0", "1"});
    expect_maps(folder.path());
    fs::rename(object / "mask/0.png", object / "mask/0.PNG");
    expect_maps(folder.path());
}

/// An object of SRN's format with two views of 8 x 8 pixels, without maps.
fs::path put_plain(const SampleFolder& folder) {
    put_object(folder / "a_train/o");
    return folder / "a_train/o";
}

std::vector<float> ramp(std::size_t count, float first, float step) {
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(first + step * static_cast<float>(i));
    return values;
}

/// Where 'priors depth DATA --out DATA --format npy' writes them.
TEST(Maps, OfArrays) {
    const SampleFolder folder;
    const fs::path object = put_plain(folder);
    for (const char* stem : {"000000.npy", "000001.npy"}) {
        put_npy(object / "depth" / stem, {8, 8}, ramp(64, -3, 0.25F));
        put_npy(object / "normal" / stem, {8, 8, 3}, ramp(192, -1, 2.0F / 191));
        put_npy(object / "mask" / stem, {8, 8}, ramp(64, 0, 1.0F / 63));
    }
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().maps, kAllMaps & ~flag_of(MapKind::kPlane));
    const ReadMaps maps = read_maps(*dataset);
    for (std::size_t i = 0; i < 64; ++i) {
        const float expected = std::round(255 * static_cast<float>(i) / 63) / 255;
        EXPECT_EQ(maps.depths[i], expected) << "between the least and the most";
        EXPECT_EQ(maps.masks[i], expected);
        EXPECT_NEAR(maps.normals[i], static_cast<float>(3 * i) / 191, 0.5001 / 255);
    }
    EXPECT_TRUE(check_object(*dataset, 0).value().problems.empty());
    const auto refused = [&](const char* file, std::vector<std::uint64_t> shape,
                             std::vector<float> values, const char* part) {
        const fs::path kept = folder / "kept.npy";
        fs::rename(object / file, kept);
        put_npy(object / file, std::move(shape), std::move(values));
        const auto found = check_object(*open_data(folder.path()), 0).value();
        ASSERT_EQ(found.problems.size(), 1U);
        EXPECT_HAS(found.problems[0], part);
        fs::rename(kept, object / file);
    };
    refused(
        "depth/000001.npy", {8, 8}, std::vector<float>(64, NAN),
        "depth/000001.npy': number 0 is nan, expected finite ones: write 0 where there is none");
    refused("normal/000000.npy", {8, 8}, std::vector<float>(64),
            "normal/000000.npy': 8 x 8 numbers of 1 channels, expected 3 channels and a square");
    refused("mask/000000.npy", {4, 8}, std::vector<float>(32), "a square");
    put_image(object / "depth/000001.png", 8, 1);
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "two files are the depth of view '000001'; remove one");
}

/// Arrays as programs write them: whole numbers, Fortran's order, channels first; PFM and PGM.
TEST(Maps, OfOtherTypesAndOrders) {
    const SampleFolder folder;
    const fs::path object = put_plain(folder);
    const auto put_array = [&](const char* file, const std::string& header, io::Bytes data) {
        std::string text = "{" + header + ", }\n";
        io::Buffer bytes;
        io::put_text(bytes, std::string_view("\x93NUMPY\x01\0", 8));
        io::put(bytes, static_cast<std::uint16_t>(text.size()));
        io::put_text(bytes, text);
        io::put_bytes(bytes, data);
        fs::create_directories((object / file).parent_path());
        ASSERT_OK(io::write_file((object / file).string(), bytes));
    };
    std::vector<std::uint16_t> millimetres;
    for (std::uint16_t i = 0; i < 64; ++i)
        millimetres.push_back(static_cast<std::uint16_t>(800 + 10 * i));
    std::vector<std::uint8_t> is_object(64);
    is_object[8] = 1;
    std::vector<float> planes;  // channel c of pixel i: (3 i + c) of 191, from -1 to 1
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < 64; ++i) planes.push_back(static_cast<float>(3 * i + c) * 2 / 191 - 1);
    std::string pgm = "P5 8 8 255\n";
    for (const std::uint8_t one : is_object) pgm += one != 0 ? '\xFF' : '\0';
    put_array("depth/000000.npy", "'descr': '<u2', 'fortran_order': True, 'shape': (8, 8)",
              std::as_bytes(std::span(millimetres)));
    put_array("normal/000000.npy", "'descr': '<f4', 'fortran_order': False, 'shape': (3, 8, 8)",
              std::as_bytes(std::span(planes)));
    put_array("mask/000000.npy", "'descr': '|b1', 'fortran_order': False, 'shape': (1, 8, 8)",
              std::as_bytes(std::span(is_object)));
    std::string pfm = "Pf 8 8 -1\n";
    for (int y = 7; y >= 0; --y)
        for (int x = 0; x < 8; ++x) {
            const auto depth = static_cast<float>(8 * y + x);
            pfm.append(reinterpret_cast<const char*>(&depth), sizeof depth);
        }
    put_text(object / "depth/000001.pfm", pfm);
    fs::copy(object / "normal/000000.npy", object / "normal/000001.npy");
    put_text(object / "mask/000001.pgm", pgm);
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().maps, kAllMaps & ~flag_of(MapKind::kPlane));
    const ReadMaps maps = read_maps(*dataset);
    for (std::size_t i = 0; i < 64; ++i) {
        const std::size_t turned = i % 8 * 8 + i / 8;
        EXPECT_EQ(maps.depths[i], std::round(255 * static_cast<float>(turned) / 63) / 255);
        EXPECT_EQ(maps.depths[64 + i], std::round(255 * static_cast<float>(i) / 63) / 255);
        EXPECT_NEAR(maps.normals[64 + i], static_cast<float>(3 * i + 1) / 191, 0.5001 / 255);
        for (const std::size_t view : {0U, 1U})
            EXPECT_EQ(maps.masks[64 * view + i], i == 8 ? 1 : 0);
    }
    EXPECT_TRUE(check_object(*dataset, 0).value().problems.empty());
    const std::vector<std::int8_t> negative(64, -1);
    put_array("mask/000000.npy", "'descr': '|i1', 'fortran_order': False, 'shape': (8, 8)",
              std::as_bytes(std::span(negative)));
    const auto found = check_object(*dataset, 0).value();
    ASSERT_EQ(found.problems.size(), 1U);
    EXPECT_HAS(found.problems[0], "mask/000000.npy': whole numbers from -1 to -1");
}

TEST(Maps, OfOtherFilesAreNamedAsNotRead) {
    const SampleFolder folder;
    const fs::path object = put_plain(folder);
    for (const char* file : {"depth/000000.tiff", "depth/000001.tiff", "mask/000000.exr"})
        put_text(object / file, std::string("II*\0", 4));
    const LogCapture log;
    const auto dataset = open_data(folder.path());
    EXPECT_HAS(log.text(),
               "3 files in folders of maps are not read, expected .png, .jpg, .webp, "
               ".pgm, .npy or .pfm: '" +
                   (object / "depth/000000.tiff").generic_string() + "', a TIFF file; convert it");
    EXPECT_EQ(dataset->index().unread_count, 3U);
    EXPECT_HAS(report_text(*dataset), "\"not_read_count\": 3");
    DatasetDesc desc = data_desc(folder.path());
    desc.maps = flag_of(MapKind::kDepth);
    EXPECT_ERROR(Dataset::open(desc), Code::kNotFound,
                 "are not read, expected .png, .jpg, .webp, .pgm, .npy or .pfm: '" +
                     (object / "depth/000000.tiff").generic_string());
}

/// Millimetres of a depth sensor: 220 different values stay so many.
TEST(Maps, DepthOf16BitsIsScaled) {
    const SampleFolder folder;
    const fs::path object = put_plain(folder);
    io::Image image{8, 8, 1, 16, {}};
    for (std::uint16_t i = 0; i < 64; ++i)
        image.samples.push_back(static_cast<std::uint16_t>(800 + 10 * i));
    for (const char* stem : {"000000.png", "000001.png"}) {
        put_png(object / "depth" / stem, image);
    }
    const auto dataset = open_data(folder.path());
    std::vector<float> depths(64);
    const std::uint32_t view = 0;
    ASSERT_OK(dataset->read(0, std::span(&view, 1), {.depths = depths.data()}));
    for (std::size_t i = 0; i < 64; ++i)
        EXPECT_EQ(depths[i], std::round(255 * static_cast<float>(i) / 63) / 255);
}

TEST(Maps, MasksOfZeroAndOneAreWhole) {
    const SampleFolder folder;
    const fs::path object = put_plain(folder);
    io::Image image{8, 8, 1, 8, std::vector<std::uint16_t>(64)};
    image.samples[5] = 1;
    for (const char* stem : {"000000.png", "000001.png"}) {
        put_png(object / "mask" / stem, image);
    }
    const ReadMaps maps = read_maps(*open_data(folder.path()), false);
    EXPECT_EQ(maps.masks[5], 1);
    EXPECT_EQ(maps.masks[6], 0);
    image.samples[6] = 2;  // shades of gray stay
    put_png(object / "mask/000000.png", image);
    EXPECT_EQ(read_maps(*open_data(folder.path()), false).masks[5], 1.0F / 255);
    image.samples.assign(64, 0);
    put_png(object / "mask/000000.png", image);
    const auto found = check_object(*open_data(folder.path()), 0).value();
    EXPECT_TRUE(std::any_of(found.warnings.begin(), found.warnings.end(), [](const auto& text) {
        return text == "the mask of view 0 is empty";
    }));
}

TEST(Maps, MayHavePluralFoldersAndWholeNames) {
    const SampleFolder folder;
    const fs::path scene = folder / "scene";
    put_text(scene / "transforms.json", kCamera);
    for (const char* name : {"a.png", "b.png"}) put_image(scene / "images" / name, 8, 3);
    put_maps(scene, {"a", "b"});
    for (const char* kind : {"depth", "normal", "mask", "plane"})
        fs::rename(scene / kind, scene / (std::string(kind) + "s"));
    fs::rename(scene / "masks/a.png", scene / "masks/a.png.png");  // COLMAP names them so
    expect_maps(folder.path());
}

TEST(Maps, MayBeNamedByTheCameras) {
    const SampleFolder folder;
    const fs::path scene = folder / "scene";
    const auto put_cameras = [&](const std::string& of_a, const std::string& of_b,
                                 const std::string& of_all = "") {
        const auto frame = [](const char* name, const std::string& more) {
            return format(R"({"file_path": "images/%s.png"%s, "transform_matrix":
                [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]})",
                          name, more.c_str());
        };
        put_text(scene / "transforms.json", R"({"fl_x": 10, "w": 8, "h": 8, )" + of_all +
                                                "\"frames\": [" + frame("a", of_a) + ", " +
                                                frame("b", of_b) + "]}");
    };
    for (const char* name : {"images/a.png", "images/b.png"}) put_image(scene / name, 8, 3);
    put_image(scene / "m/x.png", 8, 1, 90);
    put_image(scene / "m/y.png", 8, 1, 91);
    std::vector<float> metres = ramp(64, 1, 1.0F / 63);
    metres[0] = 0;  // not measured
    for (const char* name : {"d/x.npy", "d/y.npy"}) put_npy(scene / name, {8, 8}, metres);
    put_cameras(R"(, "mask_path": "m/x.png", "depth_file_path": "d/x.npy")",
                R"(, "mask_path": "m/y.png", "depth_file_path": "d/y.npy")");
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().maps, flag_of(MapKind::kMask) | flag_of(MapKind::kDepth));
    std::vector<float> masks(128), depths(128);
    const std::uint32_t views[] = {0, 1};
    ASSERT_OK(dataset->read(0, views, {.depths = depths.data(), .masks = masks.data()}));
    EXPECT_EQ(masks[64], 91.0F / 255);
    EXPECT_EQ(depths[0], 0) << "not measured";
    EXPECT_EQ(depths[1], 1) << "the nearest";
    EXPECT_EQ(depths[63], 0) << "the farthest";
    EXPECT_GT(depths[2], depths[3]);
    put_cameras(R"(, "mask_path": "m/x.png")", R"(, "mask_path": "m/none.png")");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "there is no mask map 'm/none.png'");
    put_cameras(R"(, "mask_path": "m/x.png")", "");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "b.png' has no mask map, though other frames name theirs");
    put_cameras(R"(, "mask_path": 3)", "");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat, "'mask_path' is not text");
    const auto lists = [&](const std::string& text) { put_cameras("", "", text + ", "); };
    lists(
        R"("train_filenames": ["images/a.png", "images/b.png"], "test_filenames": ["images/a.png"])");
    EXPECT_EQ(open_data(folder.path())->index().views_of[0], 2U);
    EXPECT_TRUE(open_data(folder.path())->index().has_splits);
    EXPECT_ERROR(data_status(folder.path(), "test"), Code::kFormat, "1 views, expected 2");
    bool lacks = false;
    DatasetDesc val = data_desc(folder.path(), "val");
    val.lacks_split = &lacks;
    EXPECT_ERROR(Dataset::open(val), Code::kNotFound, "lists no frames as val_filenames");
    EXPECT_TRUE(lacks);
    lists(R"("train_filenames": ["images/c.png"])");
    EXPECT_ERROR(data_status(folder.path()), Code::kFormat,
                 "train_filenames has 'images/c.png', which no frame has");
}

TEST(Maps, AlphaIsTheMask) {
    const SampleFolder folder;
    const fs::path object = folder / "a";
    put_renders(object, two_poses());
    put_renders(folder / "b", two_poses());
    put_image(object / "000.png", 8, 4, 0, 102);
    DatasetDesc desc = data_desc(folder.path());
    desc.maps = flag_of(MapKind::kMask);
    desc.background = {1, 1, 1};
    const auto dataset = open_data(desc);
    const ReadMaps maps = read_maps(*dataset, false);
    EXPECT_EQ(maps.masks[0], 0.4F);
    EXPECT_EQ(maps.masks[64], 1.0F);
    EXPECT_EQ(maps.images[0], 153.0F / 255) << "0 of 255 on white";
    put_image(object / "001.png", 8, 3);
    const std::uint32_t views[] = {0, 1};
    std::vector<float> masks(128);
    EXPECT_ERROR(open_data(desc)->read(0, views, {.masks = masks.data()}), Code::kFormat,
                 "object 'a', view 1: an image without alpha");
    desc.maps = flag_of(MapKind::kDepth);
    EXPECT_ERROR(Dataset::open(desc), Code::kNotFound,
                 "maps requested: depth; every object has: mask");
}

}  // namespace
}  // namespace splat::data
