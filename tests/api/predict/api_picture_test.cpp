// Pictures cut out through the C API: from files and from pixels of every layout. Needs no device.
#include "api/predict/picture_calls.h"

namespace splat::test {
namespace {

/// The squares of a picture of 16 x 16 pixels, as planes.
struct Squares {
    std::vector<float> image = std::vector<float>(3 * 256, -1);
    std::vector<float> mask = std::vector<float>(256, -1);
    splat_picture_info info{};

    explicit Squares(const splat_picture& picture) {
        auto desc = sized<splat_picture_cut_desc>();
        desc.resolution = 16;
        for (float& value : desc.background) value = 1;
        desc.image = planes(image, 3);
        desc.mask = planes(mask, 1);
        EXPECT_DONE(splat_picture_cut(&picture, &desc, &info));
    }
    static splat_image planes(std::vector<float>& values, std::uint32_t channels) {
        splat_image made{};
        made.pixels = values.data();
        made.bytes = values.size() * sizeof(float);
        made.type = SPLAT_PIXEL_F32;
        made.width = made.height = 16;
        made.channels = channels;
        made.row_stride = 64;
        made.pixel_stride = 4;
        made.channel_stride = 1024;
        return made;
    }
};

splat_picture picture_of(const splat_image& image) {
    splat_picture picture{};
    picture.image.pixels = image;
    return picture;
}

splat_picture picture_of(const char* path) {
    splat_picture picture{};
    picture.image.path = path;
    return picture;
}

void expect_same(const Squares& a, const Squares& b) {
    EXPECT_EQ(a.image, b.image);
    EXPECT_EQ(a.mask, b.mask);
    EXPECT_EQ(std::memcmp(&a.info, &b.info, sizeof a.info), 0);
}

TEST(ApiPicture, AFileAndItsPixelsAreCutAlike) {
    for (const std::uint32_t channels : {1U, 2U, 3U, 4U}) {
        const PictureFile file(channels);
        std::vector<std::uint8_t> bytes = picture_bytes(channels);
        const Squares from_file(picture_of(file.path()));
        const Squares from_pixels(picture_of(image_of(bytes, channels)));
        expect_same(from_file, from_pixels);
        EXPECT_EQ(from_file.info.found,
                  channels % 2 == 0 ? SPLAT_FOUND_BY_ALPHA : SPLAT_FOUND_BY_BORDER);
        EXPECT_EQ(from_file.info.warnings, 0U);
        EXPECT_EQ(from_file.info.width, 32U);
        EXPECT_EQ(from_file.info.height, 24U);
        EXPECT_EQ(from_file.info.square[2], 18) << "12 / 0.65";
        EXPECT_EQ(from_file.image[0], 1) << "white";
        EXPECT_EQ(from_file.mask[8 * 16 + 8], 1);
    }
}

TEST(ApiPicture, PixelsOfEveryLayoutAreCutAlike) {
    std::vector<std::uint8_t> bytes = picture_bytes(3);
    const Squares packed(picture_of(image_of(bytes, 3)));
    const auto expect_packed = [&](const splat_image& image, const char* what) {
        const Squares other(picture_of(image));
        EXPECT_EQ(other.image, packed.image) << what;
        EXPECT_EQ(other.mask, packed.mask) << what;
    };
    std::vector<std::uint8_t> padded(24 * 100, 7), planes(3 * 24 * 32), below(bytes.size());
    std::vector<float> floats;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        const std::size_t y = i / 96, x = i % 96 / 3, c = i % 3;
        padded[100 * y + i % 96] = bytes[i];
        planes[(c * 24 + y) * 32 + x] = bytes[i];
        below[(23 - y) * 96 + i % 96] = bytes[i];
        floats.push_back(static_cast<float>(bytes[i]) / 255);
    }
    splat_image image = image_of(padded, 3);
    image.row_stride = 100;
    expect_packed(image, "padded rows");
    image = image_of(planes, 3);
    image.row_stride = 32;
    image.pixel_stride = 1;
    image.channel_stride = 24 * 32;
    expect_packed(image, "planes");
    image = image_of(below, 3);
    image.pixels = below.data() + 23 * 96;
    image.bytes = 0;
    image.row_stride = -96;
    image.pixel_stride = 3;
    image.channel_stride = 1;
    expect_packed(image, "rows from below");
    image = image_of(bytes, 3);
    image.pixels = floats.data();
    image.bytes = floats.size() * sizeof(float);
    image.type = SPLAT_PIXEL_F32;
    expect_packed(image, "float32");
}

TEST(ApiPicture, HalvesAreReadAsTheirNumbers) {
    // 0, 0.25, 0.5, 0.75 and 1 have exact halves.
    const std::uint16_t halves[] = {0x0000, 0x3400, 0x3800, 0x3A00, 0x3C00};
    std::vector<std::uint16_t> half;
    std::vector<float> full;
    for (std::size_t i = 0; i < std::size_t{24} * 32 * 3; ++i) {
        const bool inside = i / 96 > 4 && i / 96 < 20 && i % 96 > 30 && i % 96 < 75;
        const std::size_t value = inside ? i / 7 % 4 : 4;
        half.push_back(halves[value]);
        full.push_back(static_cast<float>(value) / 4);
    }
    std::vector<std::uint8_t> none;
    splat_image image = image_of(none, 3);
    image.pixels = half.data();
    image.bytes = half.size() * 2;
    image.type = SPLAT_PIXEL_F16;
    const Squares a(picture_of(image));
    image.pixels = full.data();
    image.bytes = full.size() * 4;
    image.type = SPLAT_PIXEL_F32;
    expect_same(a, Squares(picture_of(image)));
}

TEST(ApiPicture, AMaskMarksTheObjectAndAPictureMayStayWhole) {
    std::vector<std::uint8_t> bytes = picture_bytes(3), marked = picture_bytes(4);
    std::vector<std::uint8_t> mask;
    for (std::size_t i = 3; i < marked.size(); i += 4) mask.push_back(marked[i]);
    splat_picture picture = picture_of(image_of(bytes, 3));
    picture.mask.pixels = image_of(mask, 1);
    const Squares masked(picture);
    EXPECT_EQ(masked.info.found, SPLAT_FOUND_BY_MASK);
    const Squares alpha(picture_of(image_of(marked, 4)));
    EXPECT_EQ(masked.image, alpha.image);
    EXPECT_EQ(masked.mask, alpha.mask);
    picture.flags = SPLAT_PICTURE_WHOLE;
    const Squares whole(picture);
    EXPECT_EQ(whole.info.square[0], 4);
    EXPECT_EQ(whole.info.square[2], 24) << "the largest square in the middle";
}

TEST(ApiPicture, APictureWithoutAnObjectIsWarnedOf) {
    std::vector<std::uint8_t> bytes(24 * 32 * 3, 90);
    splat_picture picture = picture_of(image_of(bytes, 3));
    const Squares cut(picture);
    EXPECT_EQ(cut.info.found, SPLAT_FOUND_NOTHING);
    EXPECT_EQ(cut.info.warnings, std::uint32_t{SPLAT_PICTURE_NO_OBJECT});
    picture.flags = SPLAT_PICTURE_WHOLE;
    EXPECT_EQ(Squares(picture).info.warnings, 0U) << "no object is looked for";
    picture.flags = 0;
    picture.focal = 20;
    EXPECT_NEAR(Squares(picture).info.fov_degrees, 101.55, 0.01) << "2 atan(49 / 40)";
}

TEST(ApiPicture, MapsAreCutWithThePicture) {
    std::vector<std::uint8_t> bytes = picture_bytes(3), depth(24 * 32, 51);
    splat_picture picture = picture_of(image_of(bytes, 3));
    picture.depth.pixels = image_of(depth, 1);
    auto desc = sized<splat_picture_cut_desc>();
    desc.resolution = 16;
    std::vector<float> cut(256, -1);
    desc.depth = Squares::planes(cut, 1);
    EXPECT_DONE(splat_picture_cut(&picture, &desc, nullptr));
    EXPECT_EQ(cut[0], 0) << "farthest, outside of the object";
    EXPECT_NEAR(cut[8 * 16 + 8], 0.2F, 1e-6F);
    std::vector<float> normal(3 * 256, -1);
    desc.normal = Squares::planes(normal, 3);
    EXPECT_REFUSED(splat_picture_cut(&picture, &desc, nullptr), SPLAT_ERROR_INVALID_ARGUMENT,
                   "desc.normal has pixels, but the picture has no such map");
    EXPECT_EQ(normal, std::vector<float>(3 * 256, -1));
}

}  // namespace
}  // namespace splat::test
