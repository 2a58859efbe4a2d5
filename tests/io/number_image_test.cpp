// Maps of numbers: .npy of every type and order, PFM, PGM; formats that are not read.
#include "io/maps/number_image.h"

#include <gtest/gtest.h>

#include "io/maps/netpbm.h"
#include "io/npy.h"
#include "io/photo/image_file.h"
#include "io/sample_scene.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

Buffer npy_of(const std::string& dtype, const std::string& shape, const Buffer& data,
              bool fortran = false) {
    const std::string header = "{'descr': '" + dtype +
                               "', 'fortran_order': " + (fortran ? "True" : "False") +
                               ", 'shape': " + shape + ", }\n";
    Buffer file;
    put_text(file, std::string_view("\x93NUMPY\x01\0", 8));
    put(file, static_cast<std::uint16_t>(header.size()));
    put_text(file, header);
    put_bytes(file, data);
    return file;
}

template <class T>
Buffer numbers(std::initializer_list<T> values, std::endian order = std::endian::little) {
    Buffer bytes;
    for (const T value : values) put(bytes, value, order);
    return bytes;
}

TEST(NpyTypes, AreAllRead) {
    const struct {
        const char* dtype;
        Buffer data;
        std::vector<float> expected;
    } samples[] = {{"<f2", numbers<std::uint16_t>({0x3C00, 0xC000}), {1, -2}},
                   {">f2", numbers<std::uint16_t>({0x3C00, 0xC000}, std::endian::big), {1, -2}},
                   {"<f8", numbers<double>({0.5, -2}), {0.5F, -2}},
                   {"|u1", numbers<std::uint8_t>({0, 255}), {0, 255}},
                   {"|i1", numbers<std::int8_t>({-1, 7}), {-1, 7}},
                   {"|b1", numbers<std::uint8_t>({0, 1}), {0, 1}},
                   {"<u2", numbers<std::uint16_t>({1, 65535}), {1, 65535}},
                   {">u2", numbers<std::uint16_t>({1, 65535}, std::endian::big), {1, 65535}},
                   {"<u4", numbers<std::uint32_t>({1, 70000}), {1, 70000}},
                   {"<u8", numbers<std::uint64_t>({1, 70000}), {1, 70000}},
                   {"<i8", numbers<std::int64_t>({-3, 70000}), {-3, 70000}}};
    for (const auto& sample : samples) {
        const auto array = read_npy(npy_of(sample.dtype, "(2,)", sample.data));
        ASSERT_OK(array) << sample.dtype;
        EXPECT_EQ(array.value().values, sample.expected) << sample.dtype;
    }
    EXPECT_ERROR(read_npy(npy_of("<c8", "(1,)", numbers<double>({1}))), Code::kUnsupported,
                 "dtype '<c8', expected floats, integers or booleans");
}

TEST(NpyTypes, FortransOrderIsTurned) {
    // [[1,2,3],[4,5,6]], column by column.
    const auto array =
        need(read_npy(npy_of("<f4", "(2, 3)", numbers<float>({1, 4, 2, 5, 3, 6}), true)));
    EXPECT_EQ(array.values, (std::vector<float>{1, 2, 3, 4, 5, 6}));
    const auto cube =
        need(read_npy(npy_of("|u1", "(2, 1, 3)", numbers<std::uint8_t>({1, 4, 2, 5, 3, 6}), true)));
    EXPECT_EQ(cube.values, (std::vector<float>{1, 2, 3, 4, 5, 6}));
    EXPECT_ERROR(read_npy(npy_of("<f4", "(1,)", {}, true)), Code::kFormat, "'data'");
}

TEST(NumberImage, ChannelsMayComeFirst) {
    Buffer planes;
    for (int i = 0; i < 3 * 2 * 5; ++i) put(planes, static_cast<float>(i));
    const auto image = need(read_number_image(npy_of("<f4", "(3, 2, 5)", planes)));
    EXPECT_EQ(image.width, 5U);
    EXPECT_EQ(image.height, 2U);
    EXPECT_EQ(image.channels, 3U);
    EXPECT_EQ(image.bits, 0U);
    EXPECT_EQ(image.values[0], 0);
    EXPECT_EQ(image.values[1], 10) << "channel 1 of the first pixel";
    EXPECT_EQ(image.values[3], 1) << "channel 0 of the second";
    const auto depth = need(
        read_number_image(npy_of("<u2", "(1, 1, 6)", numbers<std::uint16_t>({1, 2, 3, 4, 5, 6}))));
    EXPECT_EQ(depth.channels, 1U);
    EXPECT_EQ(depth.width, 6U);
    EXPECT_EQ(depth.bits, 16U);
    const auto last = need(
        read_number_image(npy_of("<f4", "(3, 1, 3)", numbers<float>({0, 1, 2, 3, 4, 5, 6, 7, 8}))));
    EXPECT_EQ(last.height, 3U) << "the last axis may be that of channels, so it is";
    EXPECT_ERROR(read_number_image(npy_of("<f4", "(5, 1, 6)", {})), Code::kUnsupported,
                 "an array [5,1,6], expected [height,width], [height,width,channels] or "
                 "[channels,height,width]");
    EXPECT_ERROR(read_number_image(npy_of("<f4", "(2, 2)", {}), NumberPart::kSize), Code::kFormat,
                 "'data'");
}

TEST(Pfm, HasItsLowestRowFirst) {
    Buffer file;
    put_text(file, "Pf\n2 2\n-1.0\n");
    for (const float value : {3.0F, 4.0F, 1.0F, 2.0F}) put(file, value);
    const auto image = need(read_number_image(file));
    EXPECT_EQ(image.values, (std::vector<float>{1, 2, 3, 4}));
    EXPECT_EQ(image.channels, 1U);
    const auto accept = [](Bytes bytes) { return read_number_image(bytes).ok(); };
    test::expect_sturdy(file, accept);
    Buffer colours;
    put_text(colours, "PF 1 1 1 ");
    for (const float value : {1.0F, 0.5F, -2.0F}) put(colours, value, std::endian::big);
    EXPECT_EQ(read_number_image(colours).value().values, (std::vector<float>{1, 0.5F, -2}));
    EXPECT_ERROR(read_number_image(as_bytes("Pf 2 2 0 ")), Code::kFormat, "the scale is '0'");
    EXPECT_ERROR(read_number_image(as_bytes("Pf 2 99999 1 ")), Code::kFormat,
                 "height is '99999', expected 1 to 16384");
}

TEST(Netpbm, GrayAndColoursAreRead) {
    const auto gray = need(read_image(as_bytes("P5\n# by a sensor\n2 1\n255\nA\xFF")));
    EXPECT_EQ(gray.samples, (std::vector<std::uint16_t>{65, 255}));
    Buffer deep;
    put_text(deep, "P5 2 1 4000\n");
    for (const std::uint16_t value : {std::uint16_t{2000}, std::uint16_t{4000}})
        put(deep, value, std::endian::big);
    const auto image = need(read_image(deep));
    EXPECT_EQ(image.bits, 16U);
    EXPECT_EQ(image.samples, (std::vector<std::uint16_t>{32768, 65535}));
    const auto accept = [](Bytes bytes) { return read_netpbm(bytes).ok(); };
    test::expect_sturdy(deep, accept);
    EXPECT_EQ(read_image(as_bytes("P6 1 1 255 abc")).value().channels, 3U);
    EXPECT_EQ(read_image(as_bytes(std::string_view("P5 2 1 1 \0\x01", 11))).value().samples,
              (std::vector<std::uint16_t>{0, 255}));
    EXPECT_ERROR(read_image(as_bytes("P5 1 1 9 A")), Code::kFormat,
                 "sample 0 is 65, above the greatest value 9");
    EXPECT_ERROR(read_image(as_bytes("P5 1 1 255 AB")), Code::kFormat,
                 "2 bytes of samples, expected 1");
    EXPECT_ERROR(read_image(as_bytes("P5 99999 1 255 A")), Code::kUnsupported, "99999");
}

TEST(UnreadImages, AreNamedWithTheCommandThatConvertsThem) {
    const struct {
        std::string_view head;
        const char* part;
    } samples[] = {{std::string_view("\0\0\0\x18"
                                     "ftypheic",
                                     12),
                    "a HEIC file; convert it: 'heif-convert"},
                   {std::string_view("\0\0\0\x1C"
                                     "ftypmif1",
                                     12),
                    "a HEIC file"},
                   {std::string_view("\0\0\0\x20"
                                     "ftypavif",
                                     12),
                    "an AVIF file; convert it: 'avifdec"},
                   {std::string_view("II*\0\x08\0\0\0", 8), "a TIFF file; convert it: 'magick"},
                   {std::string_view("MM\0*\0\0\0\x08", 8), "tifffile"},
                   {"\x76\x2F\x31\x01", "an OpenEXR file; convert it: python3"},
                   {"PK\x03\x04", "save its array itself"},
                   {"P2 1 1 255 0", "a PGM file of text"}};
    for (const auto& sample : samples)
        EXPECT_ERROR(read_image(as_bytes(sample.head)), Code::kFormat, sample.part);
    EXPECT_EQ(unread_image(as_bytes("xxxxxxxxheic")), "") << "a brand alone";
}

}  // namespace
}  // namespace splat::io
