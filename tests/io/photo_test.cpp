// JPEG and WebP, against files that their own libraries write here.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include <jpeglib.h>
#include <webp/encode.h>

#include "io/file.h"
#include "io/photo/image_file.h"
#include "io/photo/photo.h"
#include "support/expect_status.h"
#include "support/real_data.h"
#include "support/sample_jpeg.h"

namespace splat::io {
namespace {

/// Smooth, so that a JPEG of the best quality keeps it nearly.
std::vector<std::uint8_t> ramp(int width, int height, int channels) {
    std::vector<std::uint8_t> samples;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c)
                samples.push_back(static_cast<std::uint8_t>(40 + 3 * x + 2 * y + 10 * c));
    return samples;
}

Buffer jpeg_of(std::vector<std::uint8_t> samples, int width, int height, int channels,
               bool progressive, J_COLOR_SPACE space) {
    return test::sample_jpeg(std::move(samples), static_cast<JDIMENSION>(width),
                             static_cast<JDIMENSION>(height),
                             {channels, space, progressive, 100, {}});
}

Buffer webp_of(const std::vector<std::uint8_t>& samples, int width, int height, int channels) {
    std::uint8_t* bytes = nullptr;
    const std::size_t size =
        channels == 4 ? WebPEncodeLosslessRGBA(samples.data(), width, height, width * 4, &bytes)
                      : WebPEncodeLosslessRGB(samples.data(), width, height, width * 3, &bytes);
    const auto* const first = reinterpret_cast<const std::byte*>(bytes);
    Buffer file(first, first + size);
    WebPFree(bytes);
    return file;
}

/// With an Exif segment of this content.
Buffer with_segment(const Buffer& jpeg, const std::vector<std::uint8_t>& tiff) {
    Buffer file(jpeg.begin(), jpeg.begin() + 2);
    const auto length = static_cast<std::uint8_t>(2 + 6 + tiff.size());
    for (const int byte :
         {0xFF, 0xE1, 0, int{length}, int{'E'}, int{'x'}, int{'i'}, int{'f'}, 0, 0})
        file.push_back(static_cast<std::byte>(byte));
    for (const std::uint8_t byte : tiff) file.push_back(static_cast<std::byte>(byte));
    file.insert(file.end(), jpeg.begin() + 2, jpeg.end());
    return file;
}

/// An Exif segment with this orientation, in either order of bytes, behind another tag.
Buffer with_exif(const Buffer& jpeg, std::uint16_t orientation, bool little) {
    std::vector<std::uint8_t> tiff;
    const auto put = [&](std::uint32_t value, int size) {
        for (int i = 0; i < size; ++i)
            tiff.push_back(static_cast<std::uint8_t>(value >> 8 * (little ? i : size - 1 - i)));
    };
    tiff.insert(tiff.end(), 2, little ? 'I' : 'M');
    put(42, 2);
    put(8, 4);
    put(2, 2);
    for (const auto& [tag, value] :
         {std::pair<std::uint32_t, std::uint32_t>{0x100, 7}, {0x112, orientation}}) {
        put(tag, 2);
        put(3, 2);
        put(1, 4);
        put(value, 2);
        put(0, 2);
    }
    put(0, 4);
    return with_segment(jpeg, tiff);
}

TEST(Exif, TurnsEachOrientationUpright) {
    // 3 x 2 pixels numbered 0 to 5; the eight orientations of CIPA DC-008, figure of tag 274.
    const Image stored{3, 2, 1, 8, {0, 1, 2, 3, 4, 5}};
    const std::vector<std::uint16_t> expected[] = {
        {0, 1, 2, 3, 4, 5}, {2, 1, 0, 5, 4, 3}, {5, 4, 3, 2, 1, 0}, {3, 4, 5, 0, 1, 2},
        {0, 3, 1, 4, 2, 5}, {3, 0, 4, 1, 5, 2}, {5, 2, 4, 1, 3, 0}, {2, 5, 1, 4, 0, 3}};
    for (std::uint32_t orientation = 1; orientation <= 8; ++orientation) {
        const Image turned = upright(stored, orientation);
        EXPECT_EQ(turned.samples, expected[orientation - 1]) << orientation;
        EXPECT_EQ(turned.width, orientation < 5 ? 3U : 2U) << orientation;
        EXPECT_EQ(turned.height, orientation < 5 ? 2U : 3U) << orientation;
    }
}

TEST(Exif, IsReadOnRequestInEitherOrder) {
    const Buffer jpeg = jpeg_of(ramp(16, 8, 1), 16, 8, 1, false, JCS_GRAYSCALE);
    EXPECT_EQ(exif_of(jpeg, 4, 3).orientation, 1U);
    for (const bool little : {false, true}) {
        const Buffer file = with_exif(jpeg, 6, little);
        EXPECT_EQ(exif_of(file, 4, 3).orientation, 6U);
        EXPECT_EQ(read_jpeg(file).value().width, 16U);
        const auto turned = need(read_jpeg(file, {.upright = true}));
        EXPECT_EQ(turned.width, 8U);
        EXPECT_EQ(turned.samples, upright(read_jpeg(file).value(), 6).samples);
    }
}

/// An Exif segment, big-endian: a directory of one entry that names a second one, which follows it.
Buffer with_focal(const Buffer& jpeg, const std::vector<std::array<std::uint32_t, 3>>& entries,
                  const std::vector<std::uint32_t>& fractions) {
    std::vector<std::uint8_t> tiff = {'M', 'M'};
    const auto put = [&](std::uint32_t value, int size) {
        for (int i = size; i-- > 0;) tiff.push_back(static_cast<std::uint8_t>(value >> 8 * i));
    };
    const auto entry = [&](std::uint32_t tag, std::uint32_t type, std::uint32_t value) {
        put(tag, 2);
        put(type, 2);
        put(1, 4);
        put(type == 3 ? value << 16 : value, 4);
    };
    put(42, 2);
    put(8, 4);
    put(1, 2);
    entry(34665, 4, 26);  // right after this directory
    put(0, 4);
    put(static_cast<std::uint32_t>(entries.size()), 2);
    const std::size_t after = 26 + 2 + entries.size() * 12 + 4;
    for (const auto& [tag, type, value] : entries)
        entry(tag, type, type == 5 ? static_cast<std::uint32_t>(after) + value : value);
    put(0, 4);
    for (const std::uint32_t number : fractions) put(number, 4);
    return with_segment(jpeg, tiff);
}

TEST(Exif, TellsTheFocalLengthInPixels) {
    const Buffer jpeg = jpeg_of(ramp(36, 24, 1), 36, 24, 1, false, JCS_GRAYSCALE);
    EXPECT_EQ(read_jpeg(jpeg).value().focal, 0);
    // 50 mm of a film of 36 x 24 mm; a pixel is a millimetre.
    const Buffer film = with_focal(jpeg, {{41989, 3, 50}}, {});
    EXPECT_NEAR(read_jpeg(film).value().focal, 50, 1e-9);
    EXPECT_NEAR(exif_of(film, 360, 240).focal, 500, 1e-9);
    // 8.5 mm, and 3,000 pixels to a centimetre.
    const std::vector<std::array<std::uint32_t, 3>> sensor = {
        {37386, 5, 0}, {41486, 5, 8}, {41488, 3, 3}};
    EXPECT_NEAR(exif_of(with_focal(jpeg, sensor, {17, 2, 3000, 1}), 36, 24).focal, 2550, 1e-9);
    EXPECT_EQ(exif_of(with_focal(jpeg, sensor, {17, 0, 3000, 1}), 36, 24).focal, 0);
    EXPECT_EQ(exif_of(with_focal(jpeg, sensor, {17, 2}), 36, 24).focal, 0);
}

TEST(Photo, HeadersTellTheSizeWithoutPixels) {
    const Buffer jpeg = with_exif(jpeg_of(ramp(16, 8, 3), 16, 8, 3, false, JCS_RGB), 6, true);
    const Image gray{5, 3, 1, 16, std::vector<std::uint16_t>(15)};
    const std::pair<Buffer, std::array<std::uint32_t, 4>> files[] = {
        {jpeg, {8, 16, 3, 8}},
        {webp_of(ramp(5, 4, 4), 5, 4, 4), {5, 4, 4, 8}},
        {write_png(gray).value(), {5, 3, 1, 16}}};
    for (const auto& [file, expected] : files) {
        const Image found = need(read_image(file, {.upright = true, .header_only = true}));
        EXPECT_EQ((std::array{found.width, found.height, found.channels, found.bits}), expected);
        EXPECT_TRUE(found.samples.empty());
    }
}

TEST(Exif, DamageMeansUpright) {
    const Buffer jpeg = jpeg_of(ramp(16, 8, 1), 16, 8, 1, false, JCS_GRAYSCALE);
    EXPECT_EQ(exif_of(with_exif(jpeg, 9, true), 4, 3).orientation, 1U);
    const Buffer file = with_exif(jpeg, 6, true);
    for (std::size_t size = 0; size < 40; ++size)
        EXPECT_EQ(exif_of(Bytes(file).first(size), 4, 3).orientation, 1U) << size;
    for (std::size_t at = 0; at < 60; ++at) {  // any answer, but an answer
        Buffer damaged = file;
        damaged[at] ^= std::byte{0xFF};
        EXPECT_GE(exif_of(damaged, 4, 3).orientation, 1U);
        EXPECT_LE(exif_of(damaged, 4, 3).orientation, 8U);
    }
}

TEST(Jpeg, HoldsWhatWasWritten) {
    for (const bool progressive : {false, true})
        for (const int channels : {1, 3}) {
            const std::vector<std::uint8_t> samples = ramp(33, 17, channels);
            const Buffer file = jpeg_of(samples, 33, 17, channels, progressive,
                                        channels == 1 ? JCS_GRAYSCALE : JCS_RGB);
            const auto image = need(read_jpeg(file));
            EXPECT_EQ(image.width, 33U);
            EXPECT_EQ(image.height, 17U);
            EXPECT_EQ(image.channels, static_cast<std::uint32_t>(channels));
            // Quality 100 rounds to whole numbers in every step: 3 of 255 for colours at half resolution.
            for (std::size_t i = 0; i < samples.size(); ++i)
                EXPECT_NEAR(image.samples[i], samples[i], channels == 1 ? 1 : 4);
        }
}

TEST(Jpeg, RefusesOtherFiles) {
    const Buffer file = jpeg_of(ramp(33, 17, 3), 33, 17, 3, false, JCS_RGB);
    EXPECT_ERROR(read_jpeg({}), Code::kFormat, "does not start");
    EXPECT_ERROR(read_jpeg(file, {32, 1U << 20}), Code::kUnsupported, "33 x 17");
    EXPECT_ERROR(read_jpeg(file, {64, 100}), Code::kUnsupported, "100 samples");
    const Buffer cmyk = jpeg_of(ramp(8, 8, 4), 8, 8, 4, false, JCS_CMYK);
    EXPECT_ERROR(read_jpeg(cmyk), Code::kUnsupported, "CMYK");
    // The last two bytes are the end marker.
    for (std::size_t size = 0; size + 2 < file.size(); ++size)
        EXPECT_ERROR(read_jpeg(Bytes(file).first(size)), Code::kFormat, "jpeg: ") << size;
}

/// With each byte changed in three ways, the file is refused or gives a valid image.
void expect_damage_survived(const Buffer& file, Result<Image> (*read)(Bytes, const ImageOptions&)) {
    for (std::size_t i = 0; i < file.size(); ++i)
        for (const unsigned flip : {0x01U, 0x80U, 0xFFU}) {
            Buffer damaged = file;
            damaged[i] ^= static_cast<std::byte>(flip);
            const auto image = read(damaged, {64, 20000});
            if (image.ok()) {
                EXPECT_OK(check_image(image.value()));
            }
        }
}

TEST(Jpeg, SurvivesEveryDamagedByte) {
    for (const bool progressive : {false, true})
        expect_damage_survived(jpeg_of(ramp(17, 9, 3), 17, 9, 3, progressive, JCS_RGB), read_jpeg);
}

TEST(WebP, HoldsWhatWasWritten) {
    for (const int channels : {3, 4}) {
        const std::vector<std::uint8_t> samples = ramp(21, 13, channels);
        const auto image = need(read_webp(webp_of(samples, 21, 13, channels)));
        EXPECT_EQ(image.width, 21U);
        EXPECT_EQ(image.height, 13U);
        EXPECT_EQ(image.channels, static_cast<std::uint32_t>(channels));
        EXPECT_EQ(image.samples, std::vector<std::uint16_t>(samples.begin(), samples.end()));
    }
}

TEST(WebP, RefusesOtherFiles) {
    const Buffer file = webp_of(ramp(21, 13, 3), 21, 13, 3);
    EXPECT_ERROR(read_webp({}), Code::kFormat, "webp: ");
    EXPECT_ERROR(read_webp(as_bytes("not an image of any kind")), Code::kFormat, "does not start");
    EXPECT_ERROR(read_webp(file, {20, 1U << 20}), Code::kUnsupported, "21 x 13");
    for (std::size_t size = 0; size + 2 < file.size(); ++size)
        EXPECT_FALSE(read_webp(Bytes(file).first(size)).ok()) << size;
}

TEST(WebP, SurvivesEveryDamagedByte) {
    expect_damage_survived(webp_of(ramp(17, 9, 4), 17, 9, 4), read_webp);
}

TEST(ImageFile, IsKnownByItsFirstBytes) {
    EXPECT_TRUE(is_image_name("a/b.JPG") && is_image_name("x.webp") && is_image_name("x.jpeg"));
    EXPECT_FALSE(is_image_name("a.gif") || is_image_name("png") || is_image_name("a.png/b"));
    const auto folder = std::filesystem::temp_directory_path() / "splat-photo-test";
    std::filesystem::create_directories(folder);
    const std::string path = (folder / "x.png").string();
    ASSERT_OK(write_file(path, webp_of(ramp(4, 4, 3), 4, 4, 3)));
    EXPECT_OK(load_image(path));
    ASSERT_OK(write_file(path, as_bytes("GIF89a")));
    EXPECT_ERROR(load_image(path), Code::kFormat,
                 "x.png': a GIF file; convert it: 'magick IN OUT.png'");
    ASSERT_OK(write_file(path, as_bytes("text")));
    EXPECT_ERROR(load_image(path), Code::kFormat, "not a PNG, JPEG, WebP, PGM or PPM");
    ASSERT_OK(write_file(path, as_bytes("\xFF\xD8\xFF...")));
    EXPECT_ERROR(load_image(path), Code::kFormat, "x.png': jpeg: ");
    std::filesystem::remove_all(folder);
}

/// Photographs from other programs; one is a WebP file named .jpg.
TEST(RealPhotos, AreRead) {
    SPLAT_NEEDS_REAL_DATA();
    std::size_t count = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(*test::real_data_folder() + "/photos")) {
        if (!is_image_name(entry.path().string())) continue;
        EXPECT_OK(load_image(entry.path().string()));
        ++count;
    }
    EXPECT_GE(count, 8U);
}

}  // namespace
}  // namespace splat::io
