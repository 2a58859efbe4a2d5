#include "io/sample_files.h"

#include <zlib.h>

#include <vector>

#include "io/compress.h"
#include "io/number_type.h"
#include "support/system.h"

namespace splat::test {
namespace {

using io::Buffer;
using io::put;

const char* const kRanges[] = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};

std::size_t range_count(const CompressedPlyLayout& layout) {
    return layout.colors ? 18 : 12;
}

}  // namespace

void FolderTest::SetUp() {
    folder_ = std::filesystem::temp_directory_path() /
              ("splat-io-" + test::process_text() + "-" +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
}

Buffer zlib_stream(io::Bytes bytes) {
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    Buffer packed(size);
    EXPECT_EQ(
        compress(reinterpret_cast<Bytef*>(packed.data()), &size,
                 reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size())),
        Z_OK);
    packed.resize(size);
    return packed;
}

void put_png_chunk(Buffer& png, std::string_view type, io::Bytes data) {
    put(png, static_cast<std::uint32_t>(data.size()), std::endian::big);
    io::put_text(png, type);
    io::put_bytes(png, data);
    put(png, io::crc32_of(data, io::crc32_of(io::as_bytes(type))), std::endian::big);
}

std::string compressed_ply_header(const CompressedPlyLayout& layout) {
    std::string text =
        "ply\nformat binary_little_endian 1.0\nelement chunk " + layout.chunks + "\n";
    for (std::size_t i = 0; i < range_count(layout); ++i)
        text += std::string("property float ") + kRanges[i] + "\n";
    if (layout.extra) text += "property float extra\n";
    text += "element vertex " + layout.vertices + "\n";
    for (const char* name : {"position", "rotation", "scale", "color"})
        text += std::string("property uint packed_") + name + "\n";
    if (layout.extra) text += "property uchar extra\n";
    if (layout.rest > 0) text += "element sh " + layout.rest_rows + "\n";
    for (std::size_t i = 0; i < layout.rest; ++i)
        text += "property uchar f_rest_" + std::to_string(i) + "\n";
    return text + "end_header\n";
}

Buffer sample_compressed_ply(const CompressedPlyLayout& layout) {
    constexpr float kEnds[] = {-1, 2, -8, 0, -0.5F, 1.5F};  // ends of position, log scale, colour
    constexpr std::uint32_t kMiddle = 0x1FF;                // middle of 10 bits: -0.0007
    constexpr std::uint32_t kZeros = kMiddle << 10U | kMiddle;
    Buffer file;
    io::put_text(file, compressed_ply_header(layout));
    for (std::size_t i = 0; i < range_count(layout); ++i) put(file, kEnds[i / 3]);
    if (layout.extra) put(file, 0.0F);
    for (const std::uint32_t word : {0U, kMiddle << 20U | kZeros, 0U, 51U}) put(file, word);
    if (layout.extra) put(file, std::uint8_t{0});
    for (const std::uint32_t word :
         {~0U, 2U << 30U | 1023U << 20U | kZeros, ~0U, 0xFFFFFF00U + 51U})
        put(file, word);
    if (layout.extra) put(file, std::uint8_t{0});
    for (std::size_t row = 0; row < 2; ++row)
        for (std::size_t i = 0; i < layout.rest; ++i)
            put(file, static_cast<std::uint8_t>(i == 0 ? 0 : (i == 1 ? 255 : 63)));
    return file;
}

namespace {

constexpr std::uint32_t kKsplatBuckets[] = {0, 0, 1, 2,
                                            2};  ///< the bucket of each Gaussian of a section

/// A number as float32 or, in levels 1 and 2, as float16.
void put_real(Buffer& file, std::uint16_t level, float value) {
    if (level == 0)
        put(file, value);
    else
        put(file, io::to_half(value));
}

Buffer ksplat_section_header(std::uint16_t level, std::uint16_t degree) {
    Buffer header;
    const bool buckets = level > 0;
    for (const std::uint32_t word : {5U, 6U, buckets ? 2U : 0, buckets ? 3U : 0}) put(header, word);
    put(header, buckets ? 4.0F : 0.0F);             // edge of a cube
    put(header, std::uint32_t{buckets ? 12U : 0});  // bytes of a centre
    // 16 steps an eighth: 2 / 256; the size in bytes, which no reader needs; full and partial buckets
    for (const std::uint32_t word : {buckets ? 256U : 0, 0U, buckets ? 1U : 0, buckets ? 2U : 0})
        put(header, word);
    put(header, degree);
    header.resize(1024);
    return header;
}

void put_ksplat_row(Buffer& file, std::uint16_t level, std::uint16_t degree, std::size_t section,
                    std::uint32_t i) {
    const std::uint32_t bucket = kKsplatBuckets[i];
    if (level == 0) {
        put(file, 10.0F * static_cast<float>(section) + static_cast<float>(bucket) +
                      static_cast<float>(i) / 8);
        put(file, -static_cast<float>(i) / 8);
        put(file, static_cast<float>(bucket));
    } else {
        for (const std::uint32_t steps : {256 + 16 * i, 256 - 16 * i, 256U})
            put(file, static_cast<std::uint16_t>(steps));
    }
    for (const float value : {0.5F, 1.0F, 2.0F, 0.5F, -0.5F, 0.5F, -0.5F})
        put_real(file, level, value);
    for (const std::uint32_t byte : {255U, 0U, 128U, 51 + i})
        put(file, static_cast<std::uint8_t>(byte));
    for (int j = 0; j < 3 * ((degree + 1) * (degree + 1) - 1); ++j) {
        if (level == 2)
            put(file, static_cast<std::uint8_t>(10 * j));
        else
            put_real(file, level, static_cast<float>(j - 4) / 8);
    }
}

}  // namespace

Buffer sample_ksplat(std::uint16_t level, const std::vector<std::uint16_t>& degrees) {
    const auto sections = static_cast<std::uint32_t>(degrees.size());
    Buffer file = {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    for (const std::uint32_t word :
         {sections, sections, 6 * sections, 5 * sections, std::uint32_t{level}})
        put(file, word);
    for (const float value : {0.0F, 0.0F, 0.0F, -1.0F, 2.0F}) put(file, value);  // centre, range
    file.resize(4096);
    for (const std::uint16_t degree : degrees)
        io::put_bytes(file, ksplat_section_header(level, degree));
    for (std::size_t section = 0; section < degrees.size(); ++section) {
        if (level > 0) {
            for (const std::uint32_t count : {1U, 2U}) put(file, count);
            for (const float bucket : {0.0F, 1.0F, 2.0F})
                for (const float place :
                     {10.0F * static_cast<float>(section) + bucket, 0.0F, bucket})
                    put(file, place);
        }
        const std::size_t start = file.size();
        for (std::uint32_t i = 0; i < 5; ++i)
            put_ksplat_row(file, level, degrees[section], section, i);
        file.resize(file.size() + (file.size() - start) / 5);
    }
    return file;
}

Buffer sample_colmap_cameras() {
    Buffer file;
    put(file, std::uint64_t{2});
    for (const int id : {1, 2}) {
        put(file, std::int32_t{id});
        put(file, std::int32_t{id == 1 ? 1 : 0});
        put(file, std::uint64_t{id == 1 ? 64U : 10U});
        put(file, std::uint64_t{id == 1 ? 48U : 20U});
        const std::vector<double> parameters =
            id == 1 ? std::vector<double>{50, 51, 32, 24} : std::vector<double>{9, 5, 10};
        for (const double value : parameters) put(file, value);
    }
    return file;
}

Buffer sample_colmap_images() {
    Buffer file;
    put(file, std::uint64_t{2});
    for (const int id : {1, 2}) {
        put(file, std::int32_t{id});
        for (int k = 0; k < 4; ++k) put(file, id == 1 ? (k == 0 ? 1.0 : 0.0) : 0.5);
        for (int k = 0; k < 3; ++k) put(file, id == 1 ? k + 1.0 : 0.0);
        put(file, std::int32_t{id});
        io::put_text(file, id == 1 ? "a b.png" : "c.png");
        put(file, std::uint8_t{0});
        put(file, std::uint64_t{id == 1 ? 1U : 0U});
        if (id == 1) file.resize(file.size() + 24);
    }
    return file;
}

}  // namespace splat::test
