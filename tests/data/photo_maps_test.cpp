// Maps of depth and normals of photographs with cameras, as a fit reads them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "data/posed_photos.h"
#include "data/sample_formats.h"
#include "support/expect_status.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// Three photographs of 8 x 8 pixels of a pinhole, a.png held out.
class PhotoMaps : public testing::Test {
  protected:
    void SetUp() override {
        put_text(folder_ / "cameras.txt", "1 PINHOLE 8 8 10 11 4 4.5\n");
        std::string images;
        for (int i = 0; i < 3; ++i) {
            const std::string name(1, static_cast<char>('a' + i));
            images += format("%d 1 0 0 0 %d 0 4 1 %s.png\n\n", i + 1, i, name.c_str());
            put_image(folder_ / "images" / (name + ".png"), 8, 3, static_cast<std::uint32_t>(i));
        }
        put_text(folder_ / "images.txt", images);
        options_.depth = (folder_ / "depth").string();
    }
    Result<PosedPhotos> load() { return load_posed_photos(folder_.path().string(), options_); }
    void put_depth(const char* name, std::uint32_t bits = 8, std::uint32_t channels = 1,
                   std::uint32_t side = 8) {
        io::Image image{side, side, channels, bits, {}};
        for (std::uint32_t i = 0; i < side * side * channels; ++i)
            image.samples.push_back(static_cast<std::uint16_t>((100 + 2 * i) % 256));
        put_png(folder_ / "depth" / name, image);
    }
    void refuse(Code code, const std::string& sentence) {
        EXPECT_ERROR(load().status(), code, sentence);
    }

    SampleFolder folder_;
    PosedPhotosOptions options_;
};

TEST_F(PhotoMaps, OfDepthAreNearnessOfFittedPhotographs) {
    put_depth("b.png");
    std::vector<float> values(64, -3);
    values[9] = 5;
    values[10] = 1;
    put_npy(folder_ / "depth/c.png.npy", {8, 8}, values);
    const PosedPhotos read = need(load());
    ASSERT_EQ(read.photos.size(), 3U);
    EXPECT_TRUE(read.photos[0].nearness.empty()) << "it is held out";
    for (std::size_t i = 0; i < 64; ++i)
        EXPECT_FLOAT_EQ(read.photos[1].nearness[i], static_cast<float>(i) / 63);
    EXPECT_EQ(read.photos[2].nearness[0], 0);
    EXPECT_EQ(read.photos[2].nearness[9], 1);
    EXPECT_EQ(read.photos[2].nearness[10], 0.5F);
    EXPECT_TRUE(read.photos[2].normals.empty());
    // By distances: 0 is not known, and 2 is between 1 and infinity.
    for (float& value : values) value = 4;
    values[0] = 0;
    values[1] = 2;
    values[2] = 1;
    put_npy(folder_ / "depth/c.png.npy", {8, 8}, values);
    options_.depth_is_distance = true;
    const PosedPhoto far = need(load()).photos[2];
    EXPECT_TRUE(std::isnan(far.nearness[0]));
    EXPECT_FLOAT_EQ(far.nearness[1], 1.0F / 3);
    EXPECT_EQ(far.nearness[2], 1);
    EXPECT_EQ(far.nearness[3], 0);
}

TEST_F(PhotoMaps, AreReducedWithThePhotographs) {
    put_depth("b.png", 16);
    put_depth("c.png");
    options_.normals = (folder_ / "normals").string();
    std::vector<float> values(3 * 64, 0);
    for (std::size_t i = 2; i < values.size(); i += 3) values[i] = i < 96 ? -1 : 0;
    for (const char* name : {"b.npy", "c.npy"})
        put_npy(folder_ / "normals" / name, {8, 8, 3}, values);
    options_.downscale = 2;
    const PosedPhoto half = need(load()).photos[1];
    ASSERT_EQ(half.nearness.size(), 16U);
    EXPECT_FLOAT_EQ(half.nearness[0], (0 + 1 + 8 + 9) / (4 * 63.0F));
    ASSERT_EQ(half.normals.size(), 16U);
    EXPECT_EQ(half.normals[0], 255U << 24 | 0x008080U) << "(0, 0, -1)";
    EXPECT_EQ(half.normals[15], 0U) << "no normal";
    // A lens moves them as it moves the photograph.
    put_text(folder_ / "cameras.txt", "1 SIMPLE_RADIAL 8 8 10 4 4.5 0.2\n");
    const PosedPhoto straight = need(load()).photos[1];
    EXPECT_NE(straight.nearness[5], half.nearness[5]);
    for (std::size_t i = 0; i < 16; ++i)
        EXPECT_EQ(std::isnan(straight.nearness[i]), straight.pixels[i] == 0) << i;
}

TEST_F(PhotoMaps, SayWhatIsWrong) {
    put_depth("b.png");
    refuse(Code::kNotFound, "1 of 2 maps of depth are missing, such as '" +
                                (folder_ / "depth/c.png").generic_string() + "'");
    put_depth("c.png", 8, 3);
    refuse(Code::kFormat, "depth/c.png': 3 channels, expected 1");
    put_depth("c.png", 8, 1, 9);
    refuse(Code::kFormat, "depth/c.png': 9 x 9 pixels, its photograph has 8 x 8");
    put_png(folder_ / "depth/c.png", {8, 8, 1, 8, std::vector<std::uint16_t>(64, 7)});
    refuse(Code::kFormat, "depth/c.png': every number is 7, expected a map that shows something");
    fs::remove(folder_ / "depth/c.png");
    std::vector<float> values(64, 1);
    values[3] = std::numeric_limits<float>::quiet_NaN();
    put_npy(folder_ / "depth/c.npy", {8, 8}, values);
    refuse(Code::kFormat, "depth/c.npy': number 3 is nan, expected finite ones");
    values[3] = -1;
    put_npy(folder_ / "depth/c.npy", {8, 8}, values);
    EXPECT_OK(load().status());
    options_.depth_is_distance = true;
    refuse(Code::kFormat, "depth/c.npy': no two distances above 0 differ");
    put_text(folder_ / "depth/c.npy", "nothing");
    refuse(Code::kFormat, "depth/c.npy'");
    options_.depth.clear();
    options_.normals = (folder_ / "depth").string();
    fs::remove(folder_ / "depth/c.npy");
    put_depth("c.png");
    refuse(Code::kFormat, "1 channels, expected 3");
}

}  // namespace
}  // namespace splat::data
