// Small files that ask for all memory or for hours. Each is read in a process of its own, whose peak of memory
// and time are printed and compared with the budget of the file.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>

#include <jpeglib.h>
#include <webp/encode.h>
#include <zlib.h>

#include "core/config.h"
#include "core/json_tree.h"
#include "io/bomb.h"
#include "io/colmap.h"
#include "io/mesh/mesh.h"
#include "io/mesh/textures.h"
#include "io/npy.h"
#include "io/photo/image_file.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/sample_webp.h"
#include "io/sample_weights.h"
#include "io/transforms_json.h"
#include "io/weights_file.h"
#include "io/weights_formats.h"
#include "support/expect_status.h"
#include "support/sample_jpeg.h"

namespace splat::io {
namespace {

using namespace test;

constexpr std::uint32_t kSide = 16384;  ///< the largest of images

/// The header alone is refused, too: a caller would make room for its pixels.
Status image_status(Bytes file) {
    const Status status = read_image(file).status();
    const Status header = read_image(file, {.header_only = true}).status();
    const bool counts = status.message().find("are too many") != std::string::npos;
    if (counts && header.message() != status.message())
        return error(Code::kInternal, "the header: %s", header.message().c_str());
    return status;
}

Status weights_status(Bytes file) {
    return read_weights(MemorySource(file), "bomb").status();
}

/// The beginning of a square PNG of one bit for each pixel.
Buffer png_head(std::uint32_t side, unsigned color_type, bool interlaced) {
    Buffer png = bytes_of("\x89PNG\r\n\x1a\n");
    Buffer header;
    put(header, side, std::endian::big);
    put(header, side, std::endian::big);
    for (const unsigned byte : {1U, color_type, 0U, 0U, interlaced ? 1U : 0U})
        header.push_back(static_cast<std::byte>(byte));
    put_png_chunk(png, "IHDR", header);
    return png;
}

/// With a palette; `middle` lies before the pixels.
Buffer png_of(std::uint32_t side, std::string_view middle_type, const Buffer& middle,
              std::size_t repeat) {
    constexpr unsigned kPalette = 3;
    Buffer png = png_head(side, kPalette, false);
    put_png_chunk(png, "PLTE", bytes_of("abcdef"));
    for (std::size_t i = 0; i < repeat; ++i) put_png_chunk(png, middle_type, middle);
    const Buffer pixels = zlib_stream(Buffer(std::size_t{side} * ((side + 7) / 8 + 1)));
    put_png_chunk(png, "IDAT", pixels);
    put_png_chunk(png, "IEND", {});
    return png;
}

TEST(DecodeBomb, PngOfManyPixels) {
    expect_harmless("png", png_of(kSide, "tRNS", bytes_of("\x01"), 1), "png: 16384 x 16384 pixels",
                    image_status);
}

TEST(DecodeBomb, PngOfALongSide) {
    EXPECT_ERROR(read_image(png_head(20000, 0, false)), Code::kUnsupported,
                 "png: 20000 x 20000 pixels, the limit is 16384 on a side");
}

TEST(DecodeBomb, PngOfManyTexts) {
    const Buffer packed = zlib_stream(Buffer(7'900'000));
    Buffer text = bytes_of(std::string("key\0\0", 5));
    put_bytes(text, packed);
    expect_harmless("png texts", png_of(1, "zTXt", text, 300), "read", image_status);
}

/// A part of a zlib stream, of whole bytes: `bytes` zeros.
Buffer zeros(z_stream& stream, std::size_t bytes, int flush = Z_FULL_FLUSH) {
    Buffer in(bytes);
    Buffer out(bytes / 500 + 1000);
    stream.next_in = reinterpret_cast<Bytef*>(in.data());
    stream.avail_in = static_cast<uInt>(in.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    EXPECT_EQ(deflate(&stream, flush), flush == Z_FINISH ? Z_STREAM_END : Z_OK);
    out.resize(out.size() - stream.avail_out);
    return out;
}

/// `rows` bytes of gray pixels in all, then `part_bytes` zeros again and again.
Buffer png_with_more(std::uint32_t side, bool interlaced, std::size_t rows, std::size_t parts,
                     std::size_t part_bytes) {
    Buffer png = png_head(side, 0, interlaced);
    z_stream stream{};
    EXPECT_EQ(deflateInit(&stream, 9), Z_OK);
    Buffer data = zeros(stream, rows);
    const Buffer part = zeros(stream, part_bytes);
    for (std::size_t i = 0; i < parts; ++i) put_bytes(data, part);
    put_bytes(data, zeros(stream, 0, Z_FINISH));
    deflateEnd(&stream);
    for (std::size_t at = 0; at < data.size(); at += 8192)
        put_png_chunk(png, "IDAT",
                      Bytes(data).subspan(at, std::min<std::size_t>(8192, data.size() - at)));
    put_png_chunk(png, "IEND", {});
    return png;
}

/// libpng unpacks all that follows the last row.
TEST(DecodeBomb, PngOfMuchAfterThePixels) {
    struct Sample {
        std::uint32_t side;
        bool interlaced;
        std::size_t rows;  ///< bytes of all rows of all passes, each with its filter
    };
    for (const Sample& s : {Sample{16, false, 48}, Sample{15, false, 45}, Sample{16, true, 68},
                            Sample{15, true, 65}, Sample{1, true, 2}}) {
        expect_harmless("png more", png_with_more(s.side, s.interlaced, s.rows, 100, 32'000'000),
                        "more than 64 KiB of data follow the last row", image_status);
        expect_harmless("png little", png_with_more(s.side, s.interlaced, s.rows, 1, 100'000),
                        "read", image_status);
    }
}

/// Chunks after the pixels are no part of them, and may be large.
TEST(DecodeBomb, PngOfALargeChunkAfterThePixels) {
    Buffer png = png_with_more(16, true, 68, 1, 1);
    png.resize(png.size() - 12);  // without IEND
    put_png_chunk(png, "prVt", Buffer(std::size_t{1} << 20U));
    put_png_chunk(png, "IEND", {});
    EXPECT_OK(image_status(png));
}

/// A gray image without detail.
Buffer progressive_jpeg(JDIMENSION side) {
    return sample_jpeg(std::vector<std::uint8_t>(std::size_t{side} * side, 100), side, side,
                       {1, JCS_GRAYSCALE, true, 75, {}});
}

TEST(DecodeBomb, JpegOfManyPixels) {
    Buffer file = progressive_jpeg(16);
    const std::size_t frame = as_text(file).find("\xFF\xC2");  // length, depth, height, width
    for (const std::size_t at : {frame + 5, frame + 7}) file[at] = std::byte{kSide >> 8U};
    for (const std::size_t at : {frame + 6, frame + 8}) file[at] = std::byte{0};
    file.resize(600'000);
    expect_harmless("jpeg", file, "jpeg: 16384 x 16384 pixels", image_status);
}

TEST(DecodeBomb, JpegOfManyScans) {
    Buffer file = progressive_jpeg(2048);
    const std::size_t start = as_text(file).rfind("\xFF\xDA");
    const Buffer scan(file.begin() + static_cast<std::ptrdiff_t>(start), file.end() - 2);
    file.resize(file.size() - 2);
    for (int i = 0; i < 20'000; ++i) put_bytes(file, scan);
    put_text(file, "\xFF\xD9");
    expect_harmless("jpeg scans", file, "jpeg: more than 100 scans", image_status);
}

TEST(DecodeBomb, WebpOfManyPixels) {
    const Buffer file = sample_webp_of_many_pixels();
    ASSERT_EQ(file.size(), 32U);
    expect_harmless("webp", file, "webp: 16383 x 16383 pixels", image_status);
}

/// libwebp builds tables of 5 KB for codes of 20 bits, of 13 KB for those of 77, of at most 65,536 groups.
TEST(DecodeBomb, WebpOfManyPrefixCodes) {
    constexpr std::uint64_t kMostCodes = 1'400'000'000;  ///< bytes that read_webp() allows
    expect_harmless("webp codes", sample_webp_groups(256, 256), "read", image_status, kMostCodes);
    expect_harmless("webp large", sample_webp_groups(256, 256, Codes::kLarge), "read", image_status,
                    kMostCodes);
    expect_harmless("webp fewer", sample_webp_groups(65, 80), "read", image_status);

    constexpr int kWidth = 1024;
    const std::vector<std::uint8_t> gray(std::size_t{3} * kWidth * kWidth, 100);
    std::uint8_t* bytes = nullptr;
    const std::size_t size = WebPEncodeRGB(gray.data(), kWidth, kWidth, 3 * kWidth, 1, &bytes);
    const Bytes lossy = std::as_bytes(std::span(bytes, size));
    BitWriter alpha;
    alpha.put(1, 8);  // compressed, no filter
    put_vp8l_groups(alpha, kWidth / 4, kWidth / 4);
    expect_harmless("webp alpha", with_webp_alpha(lossy, kWidth, kWidth, alpha.bytes()), "read",
                    image_status, kMostCodes);
    WebPFree(bytes);
}

TEST(DecodeBomb, NpzOfManyNumbers) {
    Buffer array = write_npy_header("<f4", {15'000'000});
    array.resize(array.size() + std::size_t{15'000'000} * 4);
    expect_harmless("npz", sample_zip({{"a.npy", std::string(as_text(array)), true}}),
                    "too many for a file", weights_status);
    Buffer lie = write_npy_header("<f8", {1U << 30U, 1U << 30U});
    expect_harmless("npy", lie, "npy", [](Bytes file) { return read_npy(file).status(); });
}

/// Pushes a tuple of a storage and 300,000 more, and calls a function with it again and again.
TEST(DecodeBomb, PickleOfManyCalls) {
    PickleText pickle;
    pickle.raw("((").text("storage").global("torch", "FloatStorage").text("0").text("cpu");
    pickle.integer(1).raw("tQ");
    for (int i = 0; i < 300'000; ++i) pickle.raw("N");
    pickle.raw("tq\1");
    pickle.global("torch._utils", "_rebuild_tensor_v2").raw("q\2");
    for (int i = 0; i < 2'000; ++i) pickle.raw("h\2h\1R");
    expect_harmless("pth calls", sample_pth(pickle.done(), {}), "more arguments", weights_status);
}

TEST(DecodeBomb, PickleOfManyValues) {
    for (const std::size_t count : {3'000'000U, 30'000'000U, 60'000'000U}) {
        const std::string pickle = PickleText().raw(std::string(count, ']')).done();
        expect_harmless("pth values", sample_zip({{"a/data.pkl", pickle, true}}), "pickle: values",
                        weights_status);
    }
}

TEST(DecodeBomb, SafetensorsOfManyTensors) {
    std::string header = "{";
    for (int i = 0; i < 100'000; ++i)
        header += (i == 0 ? "\"" : ",\"") + std::to_string(i) +
                  R"(":{"dtype":"F32","shape":[0],"data_offsets":[0,0]})";
    const Buffer file = sample_safetensors(header + "}", 0);
    expect_harmless("safetensors", file, "read", [](Bytes bytes) {
        const auto read = read_safetensors(MemorySource(bytes));
        if (!read.ok()) return read.status();
        for (std::size_t i = 0; i < read.value().tensors.size(); ++i)  // a caller of each does this
            SPLAT_TRY(read.value().tensors.unchanged());
        return Status();
    });
}

/// A name of 500,000 letters that every name below it starts with.
TEST(DecodeBomb, ConfigurationOfLongNames) {
    const std::string name(500'000, 'a');
    std::string yaml = "? " + name + "\n:\n";
    std::string json = "{\"" + name + "\":{";
    for (int i = 0; i < 20'000; ++i) {
        yaml += "  k" + std::to_string(i) + ": 0\n";
        json += (i == 0 ? "\"k" : ",\"k") + std::to_string(i) + "\":0";
    }
    const Read read = [](Bytes file) { return read_config(as_text(file), "bomb").status(); };
    expect_harmless("yaml", bytes_of(yaml), "a key of 500000 letters", read);
    expect_harmless("json", bytes_of(json + "}}"), "a key of 500000 letters", read);
}

TEST(DecodeBomb, JsonOfManyValues) {
    expect_harmless("json values", bytes_of(repeated("[0", ",[]", 2'000'000, "]")), "read",
                    [](Bytes file) { return parse_json_tree(as_text(file), "bomb").status(); });
    expect_harmless("transforms", bytes_of(repeated("{\"frames\":[{}", ",{}", 500'000, "]}")),
                    "FORMAT", [](Bytes file) { return read_transforms_json(file, 8, 8).status(); });
}

TEST(DecodeBomb, ColmapOfManyRecords) {
    Buffer many;
    put(many, std::uint64_t{1} << 60U);
    put_bytes(many, Buffer(1000));
    expect_harmless("colmap", many, "FORMAT", [](Bytes file) {
        return read_colmap_binary(sample_colmap_cameras(), file, {}).status();
    });
    std::string cameras;
    std::string images;
    for (int i = 0; i < 100'000; ++i) {
        cameras += std::to_string(i) + " PINHOLE 64 48 50 51 32 24\n";
        images += std::to_string(i) + " 1 0 0 0 1 2 3 1 a\n\n";
    }
    expect_harmless("colmap text", bytes_of(images), "read", [&](Bytes file) {
        return read_colmap_text(as_bytes(cameras), file, {}).status();
    });
}

/// A mesh of glTF in text, after "asset" and "meshes".
Buffer gltf_mesh(const std::string& nodes, const std::string& roots, const std::string& accessor,
                 const std::string& more = "") {
    return bytes_of(
        R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0})" +
        more + R"(}]}],"scenes":[{"nodes":[)" + roots + R"(]}],"nodes":[)" + nodes +
        R"(],"accessors":[)" + accessor + "]}");
}

TEST(DecodeBomb, MeshesOfGltf) {
    const Read read = [](Bytes file) { return read_gltf_mesh(file).status(); };
    const auto zeros = [](int count) {
        return R"({"componentType":5126,"type":"VEC3","count":)" + std::to_string(count) + "}";
    };
    expect_harmless("gltf zeros", gltf_mesh(R"({"mesh":0})", "0", zeros(90'000'000)),
                    "gltf: vertices", read);
    std::string nodes, roots;
    for (int i = 0; i < 100'000; ++i) {
        nodes += (i == 0 ? "" : ",") + std::string(R"({"mesh":0})");
        roots += (i == 0 ? "" : ",") + std::to_string(i);
    }
    expect_harmless("gltf places", gltf_mesh(nodes, roots, zeros(3000)), "gltf: vertices", read);
    expect_harmless("gltf nodes", gltf_mesh(nodes, roots, zeros(30)), "", read);
    expect_harmless("gltf fan", gltf_mesh(R"({"mesh":0})", "0", zeros(2'000'000), R"(,"mode":6)"),
                    "gltf: ", read);
}

TEST(DecodeBomb, MaterialsOfObj) {
    std::string names = "v 0 0 0\n";
    for (int i = 0; i < 300'000; ++i) names += "usemtl " + std::to_string(i) + "\nf 1 1 1\n";
    MeshOptions options;
    options.lenient = true;
    expect_harmless("obj materials", bytes_of(names), "",
                    [&](Bytes file) { return read_obj(file, options).status(); });
    std::string libraries;
    for (int i = 0; i < 300'000; ++i) libraries += "mtllib " + std::to_string(i) + "\n";
    expect_harmless("obj libraries", bytes_of(libraries), "",
                    [&](Bytes file) { return read_obj(file, options).status(); });
    expect_harmless("mtl", bytes_of(repeated("", "newmtl a\n", 500'000, "")), "", [](Bytes file) {
        std::set<std::string> ignored;
        return read_mtl(file, ignored).status();
    });
}

TEST(DecodeBomb, ObjOfManyFaces) {
    const std::string face = repeated("f", " 1", 1'000'000, "\n");
    expect_harmless("obj", bytes_of("v 0 0 0\n" + face), "",
                    [](Bytes file) { return read_obj(file).status(); });
}

}  // namespace
}  // namespace splat::io
