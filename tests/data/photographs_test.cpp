// Photographs with cameras: what is cut off, what they lack, and where their scenes lie.
#include <gtest/gtest.h>

#include <cmath>

#include "data/dataset_check.h"
#include "data/depth_range.h"
#include "data/sample_formats.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

void put_photo(const fs::path& path, std::uint32_t width, std::uint32_t height) {
    put_png(path, {width, height, 3, 8, std::vector<std::uint16_t>(3UL * width * height, 99)});
}

/// A COLMAP model of cameras around the origin at a distance that look at it, 8 x 8 pixels, focal length 10.
void put_model(const fs::path& folder, double distance, const std::string& points) {
    std::string images;
    for (int i = 0; i < 4; ++i) {
        const double half = 0.25 * i;  // half the angle about y
        images += format("%d %.17g 0 %.17g 0 0 0 %.17g 1 %c.png\n\n", i + 1, std::cos(half),
                         std::sin(half), distance, 'a' + i);
    }
    put_text(folder / "cameras.txt", "1 SIMPLE_PINHOLE 8 8 10 4 4\n");
    put_text(folder / "images.txt", images);
    if (!points.empty()) put_text(folder / "points3D.txt", points);
}

void put_pictures(const fs::path& folder) {
    for (const char* name : {"a.png", "b.png", "c.png", "d.png"}) put_image(folder / name, 8, 3);
}

std::string warnings_of(const DatasetDesc& desc) {
    const LogCapture log;
    EXPECT_OK(Dataset::open(desc));
    return log.text();
}

TEST(Photographs, CropIsToldWithItsNumbers) {
    const SampleFolder folder;
    const fs::path scene = folder / "scene";
    for (const char* name : {"a.png", "b.png"}) put_photo(scene / name, 12, 20);
    put_text(scene / "transforms.json",
             two_frames(R"("fl_x": 10, "w": 12, "h": 20, "cx": 7, "cy": 10)", "a.png", "b.png"));
    DatasetDesc desc = data_desc(scene);
    desc.resolution = 4;
    EXPECT_EQ(warnings_of(desc),
              "'" + scene.string() +
                  "': 2 of 2 images are cut to the largest square around the principal "
                  "point: 12 x 20 pixels to 10 x 10 (42 % of them), and scaled to 4 x 4\n");
    EXPECT_HAS(report_text(*open_data(scene)), "12 x 20 pixels to 10 x 10 (42 % of them)\"");
    for (const char* name : {"a.png", "b.png"}) put_photo(scene / name, 12, 12);
    put_text(scene / "transforms.json",
             two_frames(R"("fl_x": 10, "w": 12, "h": 12)", "a.png", "b.png"));
    EXPECT_EQ(warnings_of(data_desc(scene)), "") << "squares are not cut";
}

TEST(Photographs, WithoutCamerasSayWhatTheyLack) {
    const SampleFolder folder;
    const auto refused = [&](const std::string& part) {
        EXPECT_ERROR(Dataset::open(data_desc(folder.path())), Code::kFormat, part);
    };
    refused("is not a data set of a known format");
    put_text(folder / "statue/IMG_1.HEIC", std::string("\0\0\0\x18"
                                                       "ftypheic",
                                                       12));
    refused("statue/IMG_1.HEIC' is a HEIC file; convert it: 'heif-convert");
    put_pictures(folder / "statue/images");
    refused(
        "statue/images' holds 4 pictures, but there are no cameras, which a data set needs: "
        "transforms.json (as NeRF's), or a COLMAP model");
    fs::rename(folder / "statue/images", folder / "images");
    refused("images' holds 4 pictures");
}

TEST(Photographs, OfColmapsUndistorterAreRead) {
    const SampleFolder folder;
    put_pictures(folder / "images");
    put_model(folder / "sparse", 4, "");
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().views_of[0], 4U);
    fs::rename(folder / "sparse", folder / "other");
    put_text(folder / "sparse/0/x", "");
    for (const char* file : {"cameras.txt", "images.txt"})
        fs::rename(folder / "other" / file, folder / "sparse/0" / file);
    EXPECT_NE(open_data(folder.path()), nullptr);
}

TEST(DepthRange, IsThatOfThePlaceTheCamerasLookAt) {
    const SampleFolder folder;
    put_pictures(folder / "images");
    put_model(folder / "sparse", 4, "");
    const auto dataset = open_data(folder.path());
    const auto range = need(depth_range(dataset->reader(), 0));
    EXPECT_FALSE(range.by_points);
    EXPECT_NEAR(range.near, 4 - 4 * 0.4, 1e-6) << "half of 8 pixels at 10: 0.4 of 4";
    EXPECT_NEAR(range.far, 4 + 4 * 0.4, 1e-6);
    const auto warning = [&](double znear, double zfar) {
        return need(depth_range_warning(dataset->reader(), znear, zfar));
    };
    EXPECT_EQ(warning(2.4, 5.6), "");
    EXPECT_EQ(warning(3, 5), "") << "objects need not fill the images";
    EXPECT_EQ(warning(0.8, 1.8),
              "data.znear 0.8 to data.zfar 1.8 cannot hold the scene: the cameras look at a place "
              "of which their images show what lies 2.4 to 5.6 away; set data.znear=2.34 and "
              "data.zfar=5.66");
    EXPECT_NE(warning(0.8, 4.5), "");
    EXPECT_NE(warning(3.6, 8), "");
    EXPECT_HAS(need(check_text(*dataset, 0)), "\"depths\": {\"from\": \"cameras\"");
}

TEST(DepthRange, IsThatOfColmapsPoints) {
    const SampleFolder folder;
    put_pictures(folder / "images");
    std::string points = "1 50 0 0 0 0 0 1\n";  // in no view
    for (int i = 0; i < 200; ++i) points += format("%d 0 %g 0 9 9 9 0.5 1 2\n", i + 2, 0.001 * i);
    put_model(folder / "sparse", 4, points);
    put_text(folder / "points3D.txt", "belongs to no model\n");
    const auto dataset = open_data(folder.path());
    const auto range = need(depth_range(dataset->reader(), 0));
    EXPECT_TRUE(range.by_points);
    EXPECT_NEAR(range.near, 4, 1e-5);
    EXPECT_NEAR(range.far, 4, 1e-5);
    EXPECT_EQ(depth_range_warning(dataset->reader(), 3, 5).value(), "");
    const HoldingRange holding = holding_range(range);
    EXPECT_EQ(depth_range_warning(dataset->reader(), holding.znear, holding.zfar).value(), "");
    EXPECT_LT(holding.znear, holding.zfar) << "although all points are at one depth";
    EXPECT_HAS(depth_range_warning(dataset->reader(), 0.8, 1.8).value(),
               "98 % of the COLMAP model's points in the views lie 4 to 4 away, of which they "
               "hold 0 %");
    put_text(folder / "sparse/points3D.txt", "1 0 0\n");
    EXPECT_ERROR(depth_range(dataset->reader(), 0), Code::kFormat, "points3D.txt");
}

TEST(DepthRange, IsNotKnownOfParallelCameras) {
    const SampleFolder folder;
    put_text(folder / "transforms.json",
             two_frames(R"("fl_x": 10, "w": 8, "h": 8)", "a.png", "b.png"));
    put_pictures(folder.path());
    const auto dataset = open_data(folder.path());
    EXPECT_FALSE(depth_range(dataset->reader(), 0).value().known);
    EXPECT_EQ(depth_range_warning(dataset->reader(), 0.8, 1.8).value(), "");
    EXPECT_LACKS(check_text(*dataset, 0).value(), "depths");
}

}  // namespace
}  // namespace splat::data
