// Pictures cut out through the C API: from files and from pixels of every layout. Needs no device.
#include <cmath>
#include <fstream>

#include "api/predict/picture_calls.h"
#include "support/sample_jpeg.h"

namespace splat::test {
namespace {

/// The squares of a picture of 16 x 16 pixels, as planes.
struct Squares {
    Floats image = Floats(3 * 256, -1);
    Floats mask = Floats(256, -1);
    splat_picture_info info{};

    explicit Squares(const splat_picture& picture) {
        auto desc = sized<splat_picture_cut_desc>();
        desc.resolution = 16;
        for (float& value : desc.background) value = 1;
        desc.image = planes_image(image.data(), 16);
        desc.mask = planes_image(mask.data(), 16, 1);
        EXPECT_DONE(splat_picture_cut(&picture, &desc, &info));
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
    Floats floats;
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
    image.row_stride = 32, image.pixel_stride = 1, image.channel_stride = 24 * 32;
    expect_packed(image, "planes");
    image = image_of(below, 3);
    image.pixels = below.data() + 23 * 96;
    image.bytes = 0;
    image.row_stride = -96, image.pixel_stride = 3, image.channel_stride = 1;
    expect_packed(image, "rows from below");
    expect_packed(image_of(floats, 3), "float32");
}

TEST(ApiPicture, HalvesAreReadAsTheirNumbers) {
    // 0, 0.25, 0.5, 0.75 and 1 have exact halves.
    const std::uint16_t halves[] = {0x0000, 0x3400, 0x3800, 0x3A00, 0x3C00};
    std::vector<std::uint16_t> half;
    Floats full;
    for (std::size_t i = 0; i < std::size_t{24} * 32 * 3; ++i) {
        const bool inside = i / 96 > 4 && i / 96 < 20 && i % 96 > 30 && i % 96 < 75;
        const std::size_t value = inside ? i / 7 % 4 : 4;
        half.push_back(halves[value]);
        full.push_back(static_cast<float>(value) / 4);
    }
    expect_same(Squares(picture_of(image_of(half, 3))), Squares(picture_of(image_of(full, 3))));
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

TEST(ApiPicture, TheFocalLengthIsThatOfTheExifDataUnlessGiven) {
    const Temporary path(".jpg");
    const std::vector<std::byte> file = exif_jpeg(36);
    std::ofstream(path.path(), std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()),
               static_cast<std::streamsize>(file.size()));
    splat_picture picture = picture_of(path.c_str());
    picture.flags = SPLAT_PICTURE_WHOLE;
    const Squares from_exif(picture);
    picture.focal = 20;
    const Squares given(picture);
    // The diagonals of 12 x 8 pixels and of 36 x 24 mm are 3 mm for a pixel.
    EXPECT_NEAR(from_exif.info.focal, 12, 1e-4);
    EXPECT_NEAR(from_exif.info.fov_degrees, 36.87, 0.01) << "2 atan(8 / 24)";
    EXPECT_EQ(given.info.focal, 20);
}

TEST(ApiPicture, AnObjectAtTheBorderIsWarnedOf) {
    std::vector<std::uint8_t> bytes(24 * 32 * 3, 90), mask(24 * 32, 0);
    splat_picture picture = picture_of(image_of(bytes, 3));
    picture.mask.pixels = image_of(mask, 1);
    mask[5 * 32 + 9] = mask[6 * 32 + 9] = 255;
    EXPECT_EQ(Squares(picture).info.warnings, 0U);
    for (const std::size_t pixel :
         {9, 5 * 32, 5 * 32 + 31, 23 * 32 + 9}) {  // top, left, right, bottom
        mask[pixel] = 255;
        picture.flags = 0;
        EXPECT_EQ(Squares(picture).info.warnings, std::uint32_t{SPLAT_PICTURE_AT_BORDER}) << pixel;
        picture.flags = SPLAT_PICTURE_WHOLE;
        EXPECT_EQ(Squares(picture).info.warnings, 0U) << "nothing is cut out";
        mask[pixel] = 0;
    }
}

Floats depth_of(const splat_picture& picture) {
    auto desc = sized<splat_picture_cut_desc>();
    desc.resolution = 16;
    Floats cut(256, -1);
    desc.depth = planes_image(cut.data(), 16, 1);
    EXPECT_DONE(splat_picture_cut(&picture, &desc, nullptr));
    return cut;
}

TEST(ApiPicture, MapsAreCutWithThePicture) {
    std::vector<std::uint8_t> bytes = picture_bytes(3), depth(24 * 32, 51);
    splat_picture picture = picture_of(image_of(bytes, 3));
    picture.depth.pixels = image_of(depth, 1);
    const Floats cut = depth_of(picture);
    EXPECT_EQ(cut[0], 0) << "farthest, outside of the object";
    EXPECT_NEAR(cut[8 * 16 + 8], 0.2F, 1e-6F);
    Floats normal(3 * 256, -1);
    auto desc = sized<splat_picture_cut_desc>();
    desc.resolution = 16;
    desc.normal = planes_image(normal.data(), 16);
    EXPECT_REFUSED(splat_picture_cut(&picture, &desc, nullptr), kArgument,
                   "desc.normal has pixels, but the picture has no such map");
    EXPECT_EQ(normal, Floats(3 * 256, -1));
}

TEST(ApiPicture, FloatDepthsHaveAnyScale) {
    std::vector<std::uint8_t> bytes = picture_bytes(3), expected;
    Floats metres, inverse, equal(std::size_t{24} * 32, 2.5F);
    std::vector<std::uint16_t> halves;
    for (std::size_t i = 0; i < equal.size(); ++i) {
        const auto step = static_cast<float>(i % 32 / 2) / 15;  // 255 / 15 = 17
        expected.push_back(static_cast<std::uint8_t>(17 * (i % 32 / 2)));
        metres.push_back(2 + step);
        inverse.push_back(-1e30F + 2e30F * step);
    }
    splat_picture picture = picture_of(image_of(bytes, 3));
    picture.depth.pixels = image_of(expected, 1);
    const Floats bytes_cut = depth_of(picture);
    EXPECT_GT(bytes_cut[8 * 16 + 11], bytes_cut[8 * 16 + 4] + 0.2F);
    picture.depth.pixels = image_of(metres, 1);
    EXPECT_EQ(depth_of(picture), bytes_cut) << "2 to 3";
    picture.depth.pixels = image_of(inverse, 1);
    EXPECT_EQ(depth_of(picture), bytes_cut) << "-1e30 to 1e30";
    for (std::size_t i = 0; i < equal.size(); ++i) {
        halves.push_back(i % 2 == 0 ? 0x4000 : 0x4400);  // 2 and 4
        expected[i] = i % 2 == 0 ? 0 : 255;
    }
    picture.depth.pixels = image_of(expected, 1);
    const Floats stripes = depth_of(picture);
    picture.depth.pixels = image_of(halves, 1);
    EXPECT_EQ(depth_of(picture), stripes) << "halves";
    picture.depth.pixels = image_of(equal, 1);
    EXPECT_EQ(depth_of(picture), Floats(256, 0)) << "equal depths";
}

/// A picture and all of its maps as floats, with one of them changed before each cut.
class FloatPicture {
  public:
    FloatPicture() {
        for (const std::uint8_t byte : bytes_) image.push_back(static_cast<float>(byte) / 255);
        picture.image.pixels = image_of(image, 3);
        picture.mask.pixels = image_of(mask, 1);
        picture.depth.pixels = image_of(depth, 1);
        picture.normal.pixels = image_of(normal, 3);
    }
    void expect_refused(const char* sentence) const {
        auto desc = sized<splat_picture_cut_desc>();
        desc.resolution = 16;
        Floats cut(3 * 256, -1);
        desc.image = planes_image(cut.data(), 16);
        EXPECT_REFUSED(splat_picture_cut(&picture, &desc, nullptr), kArgument, sentence);
        EXPECT_EQ(cut, Floats(3 * 256, -1));
    }

  private:
    std::vector<std::uint8_t> bytes_ = picture_bytes(3);

  public:
    Floats image, mask = Floats(768, 1), depth = Floats(768, 1), normal = Floats(3 * 768, 0.5F);
    splat_picture picture{};
};

TEST(ApiPicture, FloatsOutsideOfZeroToOneAreRefused) {
    FloatPicture normals;
    normals.normal[3 * (2 * 32 + 5) + 1] = -1;
    normals.expect_refused(
        "picture.normal.pixels at row 2, column 5, channel 1 is -1, expected 0 to 1 (it has -1 to "
        "0.5): (normal + 1) / 2; bring normals of -1 to 1 into this range");
    FloatPicture bytes;
    for (float& value : bytes.image) value *= 255;
    bytes.expect_refused("; divide values of 0 to 255 by 255, or pass 8-bit pixels");
    FloatPicture masks;
    masks.mask[33] = 255;
    masks.expect_refused(
        "picture.mask.pixels at row 1, column 1, channel 0 is 255, expected 0 to 1 (it has 1 to "
        "255); divide values of 0 to 255 by 255, or pass 8-bit pixels");
    FloatPicture negative;
    negative.image[0] = -0.5F;
    negative.expect_refused("is -0.5, expected 0 to 1 (it has -0.5 to ");
    FloatPicture rounded;
    rounded.image[0] = 1.0005F;
    rounded.normal[0] = -0.0005F;
    EXPECT_EQ(Squares(rounded.picture).info.found, SPLAT_FOUND_BY_MASK);
}

TEST(ApiPicture, NumbersThatAreNotFiniteAreRefused) {
    const struct {
        const char* sentence;
        Floats FloatPicture::*values;
        float value;
    } cases[] = {
        {"picture.image.pixels at row 0, column 0, channel 2 is nan, expected a finite "
         "number",
         &FloatPicture::image, NAN},
        {"picture.mask.pixels at row 0, column 2, channel 0 is inf", &FloatPicture::mask, INFINITY},
        {"picture.depth.pixels at row 0, column 2, channel 0 is -inf, expected a finite "
         "number; give pixels without a value a finite one, in a depth map the farthest",
         &FloatPicture::depth, -INFINITY},
        {"picture.normal.pixels at row 0, column 0, channel 2 is nan", &FloatPicture::normal, NAN}};
    for (const auto& each : cases) {
        FloatPicture wrong;
        (wrong.*each.values)[2] = each.value;
        wrong.expect_refused(each.sentence);
    }
}

TEST(ApiPicture, AMaskOfZerosAndOnesIsRefusedWithAHint) {
    std::vector<std::uint8_t> bytes = picture_bytes(3), mask(768, 0);
    mask[400] = 1;
    splat_picture picture = picture_of(image_of(bytes, 3));
    picture.mask.pixels = image_of(mask, 1);
    auto desc = sized<splat_picture_cut_desc>();
    desc.resolution = 16;
    EXPECT_REFUSED(splat_picture_cut(&picture, &desc, nullptr), kArgument,
                   "picture.mask: the mask has no pixel above one half; its largest value is 1 of "
                   "255, and 255 means inside: multiply a mask of 0 and 1 by 255");
}

}  // namespace
}  // namespace splat::test
