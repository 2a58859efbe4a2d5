// Image files and the caller's pixels. Needs no device.

#include <fstream>
#include <limits>

#include "api/api_calls.h"
#include "support/system.h"

namespace splat::test {
namespace {

using ImageBytes = std::vector<unsigned char>;

std::string image_in_memory(const splat_image& image, splat_image_format format) {
    return bytes_of(splat_image_save_memory, image, format);
}

splat_result load_image(const std::string& file, splat_image& image) {
    return splat_image_load_memory(file.data(), file.size(), &image, nullptr);
}

class ApiImage : public ::testing::Test {
  protected:
    [[nodiscard]] std::string path(const char* name) const { return folder_ / name; }

    const Temporary folder_;
};

/// 3 x 2 pixels of RGB; no two samples are alike.
ImageBytes image_samples() {
    ImageBytes bytes(18);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(13 * i);
    return bytes;
}

TEST_F(ApiImage, FilesHoldTheBytesOfMemory) {
    ImageBytes bytes = image_samples();
    const splat_image image = packed_image(bytes, 3, 2, 3);
    ASSERT_DONE(splat_image_save(path("a.png").c_str(), &image));
    ASSERT_DONE(splat_image_save(path("a.NPY").c_str(), &image));
    EXPECT_EQ(file_bytes(path("a.png")), image_in_memory(image, SPLAT_IMAGE_PNG));
    EXPECT_EQ(file_bytes(path("a.NPY")), image_in_memory(image, SPLAT_IMAGE_NPY));
    const splat_image frames[] = {image, image};
    for (const auto& [name, format] :
         {std::pair{"m.png", SPLAT_IMAGE_PNG}, std::pair{"m.gif", SPLAT_IMAGE_GIF},
          std::pair{"m.webp", SPLAT_IMAGE_WEBP}}) {
        ASSERT_DONE(splat_image_save_animation(path(name).c_str(), frames, 2, 100));
        const std::string file = file_bytes(path(name));
        EXPECT_EQ(bytes_of(splat_image_save_animation_memory, frames, 2, 100, format), file)
            << name;
    }
}

TEST_F(ApiImage, TellsItsSizeThenFillsPixels) {
    ImageBytes bytes = image_samples();
    const splat_image saved = packed_image(bytes, 3, 2, 3);
    ASSERT_DONE(splat_image_save(path("a.png").c_str(), &saved));
    splat_image image{};
    auto info = sized<splat_image_info>();
    info.focal = -1;
    ASSERT_DONE(splat_image_load(path("a.png").c_str(), &image, &info));
    EXPECT_EQ(image.width * 100 + image.height * 10 + image.channels, 323U);
    EXPECT_EQ(image.type, SPLAT_PIXEL_U8);
    EXPECT_EQ(image.bytes, 18U);
    EXPECT_EQ(info.bits, 8U);
    EXPECT_EQ(info.focal, 0);
    ImageBytes read(image.bytes);
    image.pixels = read.data();
    ASSERT_DONE(splat_image_load(path("a.png").c_str(), &image, nullptr));
    EXPECT_EQ(read, bytes);
    image.width = 4;
    EXPECT_REFUSED(splat_image_load(path("a.png").c_str(), &image, nullptr), kArgument,
                   "image.bytes is 18");
    image.bytes = 0;
    EXPECT_REFUSED(splat_image_load(path("a.png").c_str(), &image, nullptr), kShape,
                   "the image is 3 x 2 of 3");
}

/// Every type and layout holds the same picture.
TEST_F(ApiImage, FillsAndReadsAnyLayout) {
    ImageBytes bytes = image_samples();
    const std::string file = image_in_memory(packed_image(bytes, 3, 2, 3), SPLAT_IMAGE_PNG);
    struct Strides {
        std::int64_t row, pixel, channel;  ///< samples; all 0: packed
    };
    // packed, padded rows, planes, columns first, bottom row first
    for (const Strides& s : {Strides{0, 0, 0}, {11, 0, 0}, {3, 1, 6}, {3, 6, 1}, {-9, 3, 1}})
        for (const splat_pixel type : {SPLAT_PIXEL_U8, SPLAT_PIXEL_F16, SPLAT_PIXEL_F32}) {
            const std::int64_t size = type == SPLAT_PIXEL_U8 ? 1 : type == SPLAT_PIXEL_F16 ? 2 : 4;
            ImageBytes pixels(80, 0xAB);
            splat_image image = packed_image(pixels, 3, 2, 3);
            image.type = type;
            image.row_stride = s.row * size;
            image.pixel_stride = s.pixel * size;
            image.channel_stride = s.channel * size;
            if (s.row < 0) {
                image.pixels = pixels.data() - image.row_stride;
                image.bytes = 0;
            }
            ASSERT_DONE(load_image(file, image));
            EXPECT_EQ(image_in_memory(image, SPLAT_IMAGE_PNG), file) << type << ' ' << s.row;
            if (s.row == 11) {
                EXPECT_EQ(pixels[static_cast<std::size_t>(9 * size)], 0xAB) << "padding";
            }
        }
}

TEST_F(ApiImage, WidensButDropsNothing) {
    ImageBytes gray = {10, 200};
    const std::string file = image_in_memory(packed_image(gray, 2, 1, 1), SPLAT_IMAGE_PNG);
    const std::pair<std::uint32_t, ImageBytes> expected[] = {
        {1, {10, 200}},
        {2, {10, 255, 200, 255}},
        {3, {10, 10, 10, 200, 200, 200}},
        {4, {10, 10, 10, 255, 200, 200, 200, 255}}};
    for (const auto& [channels, wanted] : expected) {
        ImageBytes pixels(2 * channels);
        splat_image image = packed_image(pixels, 2, 1, channels);
        ASSERT_DONE(load_image(file, image));
        EXPECT_EQ(pixels, wanted) << channels;
    }
    ImageBytes alpha = {1, 2, 3, 4};
    const std::string two = image_in_memory(packed_image(alpha, 2, 1, 2), SPLAT_IMAGE_PNG);
    for (const std::uint32_t channels : {1U, 3U}) {
        ImageBytes pixels(2 * channels, 9);
        splat_image image = packed_image(pixels, 2, 1, channels);
        EXPECT_REFUSED(load_image(two, image), kShape, "the image is 2 x 1 of 2");
        EXPECT_EQ(pixels, ImageBytes(2 * channels, 9));
    }
}

TEST_F(ApiImage, FloatsKeepTheirBitsInNpy) {
    Floats values = {0, -1.5F, 1e-30F, 3e30F, std::numeric_limits<float>::infinity(), 0.1F};
    const splat_image image = packed_image(values, 3, 2, 1);
    const std::string file = image_in_memory(image, SPLAT_IMAGE_NPY);
    Floats read(6);
    splat_image into{};
    const auto info = got(splat_image_load_memory, file.data(), file.size(), &into);
    EXPECT_EQ(into.type, SPLAT_PIXEL_F32);
    EXPECT_EQ(into.bytes, 24U);
    EXPECT_EQ(info.bits, 32U);
    into.pixels = read.data();
    ASSERT_DONE(load_image(file, into));
    EXPECT_EQ(read, values);
    Floats clamped = {-1, 0.5F, 2, std::numeric_limits<float>::quiet_NaN()};
    const std::string png = image_in_memory(packed_image(clamped, 4, 1, 1), SPLAT_IMAGE_PNG);
    ImageBytes bytes(4);
    splat_image eight = packed_image(bytes, 4, 1, 1);
    ASSERT_DONE(load_image(png, eight));
    EXPECT_EQ(bytes, (ImageBytes{0, 128, 255, 0}));
}

TEST_F(ApiImage, TruncatedBytesAreOfNoFormat) {
    ImageBytes bytes = image_samples();
    const splat_image image = packed_image(bytes, 3, 2, 3);
    for (const splat_image_format format : {SPLAT_IMAGE_PNG, SPLAT_IMAGE_NPY}) {
        const std::string file = image_in_memory(image, format);
        Floats pixels(18);
        splat_image into = packed_image(pixels, 3, 2, 3);
        for (std::size_t size = 0; size < file.size(); ++size)
            EXPECT_EQ(splat_image_load_memory(file.data(), size, &into, nullptr), kFormat) << size;
    }
    const std::string npy = image_in_memory(image, SPLAT_IMAGE_NPY);
    splat_image header{};  // another size than the file's
    EXPECT_REFUSED(splat_image_load_memory(npy.data(), npy.size() - 1, &header, nullptr), kFormat,
                   "npy: 'data' at byte 0 needs 18 x 4 bytes, but 71 are left");
    EXPECT_DONE(load_image(npy, header));
}

/// A .npy of zeros [2,3] with another type of so many bytes, whose last number begins with a byte of 7.
std::string npy_of_type(const char* type, std::size_t bytes) {
    std::string file = image_in_memory(packed_image(Floats(6), 3, 2, 1), SPLAT_IMAGE_NPY);
    file.replace(file.find("<f4"), 3, type);
    file.resize(file.size() - 6 * sizeof(float));
    file.resize(file.size() + 6 * bytes);
    file[file.size() - bytes] = 7;
    return file;
}

TEST_F(ApiImage, ArraysOfWholeNumbersAreReadAsTheyAre) {
    for (const auto& [type, bytes] :
         {std::pair{"|u1", 1U}, std::pair{"<i4", 4U}, std::pair{"<u2", 2U}}) {
        const std::string file = npy_of_type(type, bytes);
        splat_image header{};
        ASSERT_DONE(load_image(file, header));
        EXPECT_EQ(header.width, 3U);
        EXPECT_EQ(header.type, SPLAT_PIXEL_F32);
        Floats values(6);
        splat_image into = packed_image(values, 3, 2, 1);
        ASSERT_DONE(load_image(file, into));
        EXPECT_EQ(values, (Floats{0, 0, 0, 0, 0, 7})) << type;
    }
}

TEST_F(ApiImage, ArraysOfOtherTypesAreRefusedWithAndWithoutPixels) {
    const std::string file = npy_of_type("<c8", 8);
    splat_image header{};
    EXPECT_REFUSED(load_image(file, header), kUnsupported,
                   "dtype '<c8', expected floats, integers or booleans");
    EXPECT_EQ(header.width, 0U);
    Floats values(6);
    splat_image into = packed_image(values, 3, 2, 1);
    EXPECT_REFUSED(load_image(file, into), kUnsupported,
                   "dtype '<c8', expected floats, integers or booleans");
}

TEST_F(ApiImage, ErrorsTellFilesApart) {
    splat_image image{};
    EXPECT_REFUSED(splat_image_load(path("none.png").c_str(), &image, nullptr), kNotFound,
                   "none.png': No such file");
    EXPECT_REFUSED(splat_image_load(folder_.c_str(), &image, nullptr), kIo, "not a regular file");
    if (makes_links_in(folder_.path())) {
        std::filesystem::create_symlink("loop.png", path("loop.png"));
        EXPECT_REFUSED(splat_image_load(path("loop.png").c_str(), &image, nullptr), kIo,
                       "loop.png");
    }
    std::ofstream(path("text.png")) << "text";
    EXPECT_REFUSED(splat_image_load(path("text.png").c_str(), &image, nullptr), kFormat,
                   "text.png': not a PNG, JPEG, WebP, PGM or PPM file");
    EXPECT_EQ(image.width, 0U);
    if (kHasPermissions && !is_root()) {  // root reads all files
        std::filesystem::permissions(path("text.png"), std::filesystem::perms::none);
        EXPECT_REFUSED(splat_image_load(path("text.png").c_str(), &image, nullptr), kIo, "denied");
    }
}

}  // namespace
}  // namespace splat::test
