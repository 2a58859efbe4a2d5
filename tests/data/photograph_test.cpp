#include "data/photograph.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "io/file.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

/// A red rectangle, columns 20 to 59 and rows 10 to 29, on a ground of one colour.
io::Image picture(std::uint32_t channels, std::uint16_t ground) {
    io::Image image{.width = 100, .height = 50, .channels = channels, .samples = {}};
    for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x) {
            const bool inside = x >= 20 && x < 60 && y >= 10 && y < 30;
            const std::uint16_t rgba[4] = {
                inside ? std::uint16_t{255} : ground, inside ? std::uint16_t{0} : ground,
                inside ? std::uint16_t{0} : ground, inside ? std::uint16_t{255} : std::uint16_t{0}};
            image.samples.insert(image.samples.end(), rgba, rgba + channels);
        }
    return image;
}

class PhotographRules : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / "splat_photograph";
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    std::string save(const char* name, const io::Image& image) {
        const std::string path = (folder_ / name).string();
        EXPECT_OK(io::write_file(path, need(io::write_png(image))));
        return path;
    }
    /// Paths of a picture and its maps, and how to cut it.
    struct Files {
        std::string image, depth = {}, normal = {}, mask = {};
        data::CutOptions options = {.resolution = 32, .foreground = 0.5};
    };
    static Result<data::Photograph> read(const Files& files) {
        const auto load = [](const std::string& path,
                             std::optional<data::NamedImage>& to) -> Status {
            if (path.empty()) return {};
            SPLAT_ASSIGN(to, data::load_picture(path));
            return {};
        };
        data::Picture picture;
        SPLAT_ASSIGN(picture.image, data::load_picture(files.image));
        SPLAT_TRY(load(files.depth, picture.depth));
        SPLAT_TRY(load(files.normal, picture.normal));
        SPLAT_TRY(load(files.mask, picture.mask));
        return data::cut_photograph(picture, files.options);
    }
    /// The rectangle of 40 x 20 pixels in the middle of a square of 80 = 32 pixels: 16 x 8 of them.
    static void expect_in_the_middle(const data::Photograph& photo) {
        EXPECT_EQ(photo.side, 80);
        EXPECT_EQ(photo.x, 0);
        EXPECT_EQ(photo.y, -20);
        ASSERT_EQ(photo.image.size(), 3U * 32 * 32);
        for (const std::size_t pixel : {16U * 32 + 16U, 13U * 32 + 9U, 18U * 32 + 22U}) {
            EXPECT_EQ(photo.image[pixel], 1) << pixel;
            EXPECT_EQ(photo.image[1024 + pixel], 0) << pixel;
            EXPECT_EQ(photo.mask[pixel], 1) << pixel;
        }
        for (const std::size_t pixel : {0U, 6U * 32 + 16U, 16U * 32 + 3U, 1023U}) {
            EXPECT_EQ(photo.image[1024 + pixel], 1) << "white at " << pixel;
            EXPECT_EQ(photo.mask[pixel], 0) << pixel;
        }
    }

    fs::path folder_;
};

TEST_F(PhotographRules, FollowsTheAlpha) {
    const auto photo = need(read({save("a.png", picture(4, 90))}));
    EXPECT_EQ(photo.mask_from, data::MaskFrom::kAlpha);
    EXPECT_STREQ(data::mask_from_name(photo.mask_from), "alpha");
    expect_in_the_middle(photo);
    EXPECT_TRUE(photo.depth.empty());
}

TEST_F(PhotographRules, FloodsFromTheBorder) {
    io::Image image = picture(3, 200);
    for (std::size_t pixel = 0; pixel < 300; ++pixel)
        image.samples[3 * pixel] =
            static_cast<std::uint16_t>(195 + pixel % 10);  // not quite uniform
    const auto photo = need(read({save("b.png", image)}));
    EXPECT_EQ(photo.mask_from, data::MaskFrom::kBorder);
    EXPECT_STREQ(data::mask_from_name(photo.mask_from), "border");
    expect_in_the_middle(photo);
    // An alpha of a screenshot, which leaves nothing out.
    io::Image opaque = picture(4, 200);
    for (std::size_t i = 3; i < opaque.samples.size(); i += 4) opaque.samples[i] = 255;
    const auto screenshot = need(read({save("screenshot.png", opaque)}));
    EXPECT_EQ(screenshot.mask_from, data::MaskFrom::kBorder);
    expect_in_the_middle(screenshot);
}

/// A square of 20 pixels in the middle of 60, white inside where it opens to one side.
TEST_F(PhotographRules, FloodsIntoPocketsOfAllSides) {
    for (const int side : {0, 1, 2, 3}) {
        io::Image image;
        image.width = image.height = 60;
        image.channels = 3;
        for (int y = 0; y < 60; ++y)
            for (int x = 0; x < 60; ++x) {
                const int along = side % 2 == 0 ? x : y, across = side % 2 == 0 ? y : x;
                const int depth = side < 2 ? along : 59 - along;  // from the side that is closed
                const bool object = x >= 20 && x < 40 && y >= 20 && y < 40;
                const bool pocket = across >= 26 && across < 34 && depth >= 25;
                image.samples.insert(image.samples.end(), 3, object && !pocket ? 0 : 255);
            }
        const auto photo = need(read({save("pocket.png", image)}));
        EXPECT_EQ(photo.mask_from, data::MaskFrom::kBorder);
        EXPECT_EQ(photo.mask[16 * 32 + 16], 0) << "in the pocket of side " << side;
        const std::size_t closed[] = {16 * 32 + 9, 9 * 32 + 16, 16 * 32 + 22, 22 * 32 + 16};
        EXPECT_EQ(photo.mask[closed[side]], 1) << "at the end of that of side " << side;
    }
}

TEST_F(PhotographRules, TakesAMaskAndMaps) {
    Files desc{save("c.png", picture(3, 40))};
    io::Image mask = picture(4, 0);
    io::Image gray{.width = mask.width, .height = mask.height, .channels = 1, .samples = {}};
    for (std::size_t i = 0; i < mask.samples.size(); i += 4)
        gray.samples.push_back(mask.samples[i + 3]);
    desc.mask = save("mask.png", gray);
    for (std::uint16_t& sample : gray.samples) sample = 51;
    desc.depth = save("depth.png", gray);
    desc.normal = save("normal.png", gray);
    const auto photo = need(read(desc));
    EXPECT_EQ(photo.mask_from, data::MaskFrom::kMask);
    EXPECT_STREQ(data::mask_from_name(photo.mask_from), "mask");
    expect_in_the_middle(photo);
    const std::size_t middle = 16 * 32 + 16;
    ASSERT_EQ(photo.depth.size(), 1024U);
    EXPECT_NEAR(photo.depth[middle], 0.2F, 1e-6F) << "51 of 255";
    EXPECT_EQ(photo.depth[0], 0);
    ASSERT_EQ(photo.normal.size(), 3072U);
    EXPECT_NEAR(photo.normal[2048 + middle], 0.2F, 1e-6F);
    EXPECT_EQ(photo.normal[0], 0.5F);
}

TEST_F(PhotographRules, AUniformPictureIsTheObject) {
    io::Image image = picture(3, 0);
    std::fill(image.samples.begin(), image.samples.end(), std::uint16_t{80});
    const auto photo = need(read({save("d.png", image)}));
    EXPECT_EQ(photo.mask_from, data::MaskFrom::kNothing);
    EXPECT_STREQ(data::mask_from_name(photo.mask_from), "nothing");
    Files whole{save("e.png", picture(4, 0))};
    whole.options.crop = false;
    const auto square = need(read(whole));
    EXPECT_EQ(square.side, 50) << "the largest square in the middle";
    EXPECT_EQ(square.x, 25);
}

TEST_F(PhotographRules, SamplesOf16BitsAreReducedTo8) {
    data::Picture eight{{picture(4, 90), "eight"}, {}, {}, {}};
    data::Picture sixteen = eight;
    sixteen.image.image.bits = 16;
    for (std::uint16_t& sample : sixteen.image.image.samples)
        sample = static_cast<std::uint16_t>(257 * sample - (sample == 0 ? 0 : 100));
    for (data::Picture* each : {&eight, &sixteen}) each->mask = each->depth = each->image;
    const auto a = need(data::cut_photograph(eight, {})),
               b = need(data::cut_photograph(sixteen, {}));
    EXPECT_EQ(a.image, b.image);
    EXPECT_EQ(a.mask, b.mask);
    EXPECT_EQ(a.depth, b.depth);
}

TEST_F(PhotographRules, RefusesAndNamesTheFile) {
    Files desc{"nowhere.png"};
    EXPECT_ERROR(read(desc), Code::kNotFound, "nowhere.png");
    desc.image = save("f.png", picture(3, 200));
    io::Image small = picture(3, 0);
    small.height = 25;
    small.samples.resize(small.samples.size() / 2);
    desc.depth = save("small.png", small);
    EXPECT_ERROR(read(desc), Code::kInvalidArgument,
                 "is 100 x 25 pixels, expected the image's 100 x 50");
    desc.depth.clear();
    io::Image black = picture(3, 0);
    std::fill(black.samples.begin(), black.samples.end(), std::uint16_t{0});
    desc.mask = save("black.png", black);
    EXPECT_ERROR(read(desc), Code::kInvalidArgument, "the mask has no pixel above one half");
    desc.options.foreground = 0;
    EXPECT_ERROR(read(desc), Code::kInvalidArgument, "foreground is 0");
}

}  // namespace
}  // namespace splat::test
