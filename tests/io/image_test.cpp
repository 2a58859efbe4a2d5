#include "io/image.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "io/animation.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/npy.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "support/expect_status.h"
#include "support/npz.h"
#include "support/real_data.h"

namespace splat::io {
namespace {

Image sample_image(std::uint32_t width, std::uint32_t height, std::uint32_t channels,
                   std::uint32_t bits = 8, unsigned seed = 1) {
    Image image{width, height, channels, bits, {}};
    unsigned state = seed;
    for (std::size_t i = 0; i < std::size_t{width} * height * channels; ++i) {
        state = state * 1664525U + 1013904223U;
        image.samples.push_back(static_cast<std::uint16_t>(
            bits == 16 ? state >> 16U : (i * 3 + (state >> 30U)) & 255U));
    }
    return image;
}

using test::bytes_of;

bool accepts_image(Bytes file) {
    return read_png(file, {64, 4096}).ok();
}

TEST(Png, RoundTripIsExact) {
    for (const std::uint32_t bits : {8U, 16U})
        for (std::uint32_t channels = 1; channels <= 4U; ++channels) {
            const Image image = sample_image(13, 7, channels, bits);
            const auto read = need(read_png(need(write_png(image))));
            EXPECT_EQ(read.width, 13U);
            EXPECT_EQ(read.height, 7U);
            EXPECT_EQ(read.channels, channels);
            EXPECT_EQ(read.bits, bits);
            EXPECT_EQ(read.samples, image.samples);
        }
}

/// 5 x 3 pixels, numbered, in the seven passes of Adam7: the first pixel of 8 x 8, then the gaps.
TEST(Png, ReadsInterlacedFiles) {
    Buffer png = bytes_of("\x89PNG\r\n\x1a\n");
    test::put_png_chunk(png, "IHDR",
                        bytes_of(std::string("\0\0\0\x05\0\0\0\x03\x08\0\0\0\x01", 13)));
    // Each row of a pass begins with its filter, 0.
    const Buffer pixels = test::zlib_stream(bytes_of(std::string(
        "\0\0\0\x04\0\x02\0\x0A\x0C\x0E\0\x01\x03\0\x0B\x0D\0\x05\x06\x07\x08\x09", 22)));
    test::put_png_chunk(png, "IDAT", pixels);
    test::put_png_chunk(png, "IEND", {});
    const auto read = need(read_png(png));
    EXPECT_EQ(read.width, 5U);
    EXPECT_EQ(read.samples,
              (std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14}));
}

TEST(Png, DeepImagesOfFloatsAreRoundedAndClamped) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> values = {0, 1, 0.5F, -1, 2, nan, 1.4F / 65535};
    EXPECT_EQ(image_from_floats(values, 7, 1, 1, 16).samples,
              (std::vector<std::uint16_t>{0, 65535, 32768, 0, 65535, 0, 1}));
}

TEST(Png, FastFilesHoldTheSame) {
    const Image image = sample_image(130, 70, 3);
    const auto file = need(write_png(image, PngEffort::kFast));
    EXPECT_EQ(need(read_png(file)).samples, image.samples);
    EXPECT_NE(file, write_png(image).value());
}

TEST(Png, RefusesToWriteWhatDoesNotFit) {
    Image image = sample_image(4, 4, 3);
    image.samples.pop_back();
    EXPECT_ERROR(write_png(image), Code::kInvalidArgument, "with 47 samples");
    image.samples.push_back(256);
    EXPECT_ERROR(write_png(image), Code::kInvalidArgument, "sample 256");
    EXPECT_FALSE(write_png(Image{0, 4, 3, 8, {}}).ok());
    EXPECT_FALSE(write_png(Image{1, 1, 5, 8, {1, 2, 3, 4, 5}}).ok());
}

TEST(Png, RefusesEveryPrefixAndSurvivesDamage) {
    for (const std::uint32_t bits : {8U, 16U}) {
        const auto file = need(write_png(sample_image(5, 3, 1, bits)));
        test::expect_sturdy(file, accepts_image);
    }
    EXPECT_ERROR(read_png(test::bytes_of("not a png at all")), Code::kFormat, "does not start");
}

TEST(Png, RefusesLargeImages) {
    const auto file = need(write_png(sample_image(65, 2, 3)));
    EXPECT_FALSE(accepts_image(file));
    EXPECT_ERROR(read_png(file, {100, 389}), Code::kUnsupported, "389 samples");
    EXPECT_OK(read_png(file, {100, 390}));
}

TEST(Png, FloatsAreRoundedAndClamped) {
    const float values[] = {0, 1, 0.5F, -1, 2, std::numeric_limits<float>::quiet_NaN()};
    EXPECT_EQ(image_from_floats(values, 2, 1, 3).samples,
              (std::vector<std::uint16_t>{0, 255, 128, 0, 255, 0}));
}

struct Chunk {
    std::string type;
    Buffer data;
};

std::vector<Chunk> chunks_of(const Buffer& file) {
    std::vector<Chunk> chunks;
    for (std::size_t at = 8; at < file.size();) {
        const auto size = number<std::uint32_t>(file.data() + at, std::endian::big);
        const Bytes data = Bytes(file).subspan(at + 8, size);
        chunks.push_back(
            {std::string(as_text(Bytes(file).subspan(at + 4, 4))), {data.begin(), data.end()}});
        at += 12 + size;
    }
    return chunks;
}

TEST(Apng, ChunksAreInOrderAndHoldTheFrames) {
    const std::vector<Image> frames = {sample_image(9, 5, 3, 8, 1), sample_image(9, 5, 3, 8, 2),
                                       sample_image(9, 5, 3, 8, 3)};
    const auto file = need(write_apng(frames, {40, 2}));
    EXPECT_EQ(need(read_png(file)).samples, frames[0].samples) << "programs without animation";
    std::string types;
    std::uint32_t sequence = 0;
    std::size_t frame = 0;
    for (const Chunk& chunk : chunks_of(file)) {
        types += chunk.type + " ";
        if (chunk.type != "fcTL" && chunk.type != "fdAT") continue;
        EXPECT_EQ(number<std::uint32_t>(chunk.data.data(), std::endian::big), sequence++);
        if (chunk.type != "fdAT") continue;
        // Alone, the frame is an IDAT of the same bytes, which libpng decodes in the next test.
        const auto alone = need(write_apng({frames[++frame]}));
        EXPECT_EQ(Buffer(chunk.data.begin() + 4, chunk.data.end()), chunks_of(alone)[3].data);
    }
    EXPECT_EQ(types, "IHDR acTL fcTL IDAT fcTL fdAT fcTL fdAT IEND ");
}

TEST(Apng, EveryFilterDecodes) {
    for (std::uint32_t channels = 1; channels <= 4; ++channels)
        for (unsigned seed = 1; seed < 6; ++seed) {
            Image image = sample_image(17, 11, channels, 8, seed);
            for (std::size_t i = 0; i < image.samples.size() / 2; ++i)
                image.samples[i] =
                    static_cast<std::uint16_t>((i / (17 * channels)) * seed * 5 % 256);
            EXPECT_EQ(need(read_png(need(write_apng({image})))).samples, image.samples);
        }
}

TEST(Apng, RefusesFramesThatDiffer) {
    EXPECT_ERROR(write_apng({}), Code::kInvalidArgument, "no frame");
    EXPECT_ERROR(write_apng({sample_image(4, 4, 3), sample_image(4, 5, 3)}), Code::kInvalidArgument,
                 "4 x 5 x 3");
    EXPECT_FALSE(write_apng({sample_image(4, 4, 1, 16)}).ok());
    EXPECT_FALSE(write_apng({sample_image(4, 4, 3)}, {0, 0}).ok());
}

TEST(Npy, RoundTripAndASecondReader) {
    for (const std::vector<std::uint64_t>& shape :
         {std::vector<std::uint64_t>{}, {6}, {2, 3}, {1, 2, 3}, {0, 3}}) {
        FloatArray array{shape, {}};
        std::uint64_t count = 1;
        for (const std::uint64_t dim : shape) count *= dim;
        for (std::uint64_t i = 0; i < count; ++i) array.values.push_back(static_cast<float>(i) / 3);
        const auto file = need(write_npy(array));
        const auto read = need(read_npy(file));
        EXPECT_EQ(read.shape, shape);
        EXPECT_EQ(read.values, array.values);
        EXPECT_EQ(need(need(test::parse_npy(file, "npy")).f32()), array.values);
    }
    EXPECT_FALSE(write_npy({{3}, {1, 2}}).ok());
}

Buffer npy(const std::string& header) {
    Buffer file = test::bytes_of("\x93NUMPY");
    put(file, std::uint16_t{1});
    put(file, static_cast<std::uint16_t>(header.size()));
    put_text(file, header);
    return file;
}

TEST(Npy, ReadsDoublesAndBigEndian) {
    Buffer file = npy("{'descr': '>f8', 'fortran_order': False, 'shape': (2,), }\n");
    put(file, 0.25, std::endian::big);
    put(file, -3.0, std::endian::big);
    EXPECT_EQ(need(read_npy(file)).values, (std::vector<float>{0.25F, -3.0F}));
    const auto accept = [](Bytes bytes) { return read_npy(bytes).ok(); };
    test::expect_sturdy(file, accept);
}

TEST(Npy, RefusesHostileHeaders) {
    const auto refused = [](const std::string& header, Code code, const char* part) {
        EXPECT_ERROR(read_npy(npy(header)), code, part);
    };
    const std::string start = "{'descr': '<f4', 'fortran_order': False, 'shape': ";
    refused(start + "(1000000000000,)}", Code::kFormat, "'data'");
    refused(start + "(4294967296, 4294967296, 4294967296)}", Code::kFormat, "2^64");
    refused(start + "(-1,)}", Code::kFormat, "tuple");
    refused(start + "(1", Code::kFormat, "tuple");
    refused(start + "3}", Code::kFormat, "tuple");
    refused("{}", Code::kFormat, "no 'descr'");
    refused("{'descr': '<c8', 'fortran_order': False, 'shape': ()}", Code::kUnsupported, "'<c8'");
    refused("{'descr': '<f4', 'fortran_order': Maybe, 'shape': ()}", Code::kFormat,
            "'fortran_order'");
}

TEST(RealImages, EveryPngIsRead) {
    SPLAT_NEEDS_REAL_DATA();
    std::size_t files = 0;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(*test::real_data_folder())) {
        if (entry.path().extension() != ".png" || entry.file_size() > 500000) continue;
        const auto file = need(read_file(entry.path().string()));
        const auto image = read_png(file);
        EXPECT_OK(image) << entry.path();
        ++files;
    }
    EXPECT_GT(files, 14U);
}

}  // namespace
}  // namespace splat::io
