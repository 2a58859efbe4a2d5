// Small files of scenes that ask for all memory or for hours. Each is read in a process of its own, whose peak of
// memory and time are printed and compared with the budget of the file.
#include <gtest/gtest.h>

#include <cstring>

#include "io/bomb.h"
#include "io/compress.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/sample_webp.h"
#include "io/sample_weights.h"
#include "io/scene_file.h"
#include "io/scenes/sample_gltf.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using namespace test;

/// A header of .spz with 800,000 Gaussians of degree 3.
Buffer spz_header(std::uint32_t version) {
    Buffer header = bytes_of("NGSP");
    put(header, version);
    put(header, std::uint32_t{800'000});
    put_text(header, version < 4 ? std::string_view("\x03\x0C\0\0", 4)
                                 : std::string_view("\x03\x0C\0\x06", 4));
    return header;
}

Status scene_status(Bytes file) {
    return read_scene(file, "bomb").status();
}

TEST(DecodeBomb, SpzOfManyGaussians) {
    Buffer plain = spz_header(2);
    plain.resize(plain.size() + std::size_t{800'000} * 64);
    const auto file = need(gzip(plain));
    expect_harmless("spz", file, "spz: Gaussians: 800000 x 236 bytes", scene_status);

    Buffer streams = spz_header(4);
    put(streams, std::uint32_t{32});
    streams.resize(32);
    Buffer packed;
    for (const std::size_t each : {9U, 1U, 3U, 3U, 4U, 45U}) {
        const auto stream = need(zstd(Buffer(800'000 * each)));
        put(streams, std::uint64_t{stream.size()});
        put(streams, std::uint64_t{800'000 * each});
        put_bytes(packed, stream);
    }
    put_bytes(streams, packed);
    expect_harmless("spz 4", streams, "spz: Gaussians: 800000 x 236 bytes", scene_status);
}

/// An archive whose images are all the same one.
Buffer sog_of(const std::string& count, const Buffer& image) {
    std::string codes = "[0";
    for (int i = 1; i < 256; ++i) codes += ",0";
    codes += "]";
    const std::string meta =
        "{\"version\":2,\"count\":" + count +
        R"(,"means":{"mins":[0,0,0],"maxs":[1,1,1],"files":["a","b"]},"quats":{"files":["c"]},)" +
        R"("scales":{"files":["d"],"codebook":)" + codes + R"(},"sh0":{"files":["e"],"codebook":)" +
        codes + "}}";
    std::vector<ZipPart> parts = {{"meta.json", meta, true}};
    for (const char* name : {"a", "b", "c", "d", "e"})
        parts.emplace_back(name, std::string(as_text(image)), true);
    return sample_zip(parts);
}

TEST(DecodeBomb, SogOfManyPixels) {
    expect_harmless("sog", sog_of("5", sample_webp_of_many_pixels()), "sog: 'a': pixels",
                    scene_status);
    expect_harmless("sog count", sog_of("100000000", sample_webp_of_many_pixels()),
                    "sog: Gaussians: 100000000 x 56 bytes", scene_status);
    constexpr std::uint64_t kMostCodes = 1'400'000'000;  ///< bytes that read_webp() allows
    expect_harmless("sog codes", sog_of("5", sample_webp_groups(128, 128)), "read", scene_status,
                    kMostCodes);
    expect_harmless("sog deflated", sample_zip({{"meta.json", std::string(60'000'000, ' '), true}}),
                    "sog: meta.json", scene_status);
    expect_harmless("sog zeros", sample_zip({{"meta.json", std::string(100'000'000, ' '), true}}),
                    "too many for a file", scene_status);
}

TEST(DecodeBomb, PlyOfManyRows) {
    const std::string names =
        "property uchar x\nproperty uchar y\nproperty uchar z\nproperty uchar opacity\n"
        "property uchar f_dc_0\nproperty uchar f_dc_1\nproperty uchar f_dc_2\n"
        "property uchar scale_0\nproperty uchar scale_1\nproperty uchar scale_2\n"
        "property uchar rot_0\nproperty uchar rot_1\nproperty uchar rot_2\nproperty uchar rot_3\n";
    for (const char* form : {"ascii", "binary_little_endian"}) {
        const std::string start = std::string("ply\nformat ") + form + " 1.0\nelement vertex ";
        expect_harmless("ply", bytes_of(start + "1000000000000\n" + names + "end_header\n"),
                        "FORMAT", scene_status);
    }
    std::string flood =
        "ply\nformat binary_little_endian 1.0\nelement nothing 1000000000000000\n"
        "element vertex 70000\n" +
        names + "end_header\n";
    flood.resize(flood.size() + std::size_t{70'000} * 14);
    expect_harmless("ply rows", bytes_of(flood), "read", scene_status);
    expect_harmless("ply packed",
                    sample_compressed_ply({.vertices = "100000000", .rest_rows = "0"}),
                    "'vertex' at byte", scene_status);
}

TEST(DecodeBomb, SplatHasNoBomb) {
    expect_harmless("splat", Buffer(std::size_t{32} * 100'000), "read",
                    [](Bytes file) { return read_scene(file, "bomb.splat").status(); });
}

TEST(DecodeBomb, KsplatOfManySections) {
    const auto status = [](Bytes file) { return read_scene(file, "bomb.ksplat").status(); };
    Buffer lie = sample_ksplat(2, {2});
    for (const std::size_t place : {16U, 4096U, 4096U + 4, 4096U + 8}) {  // counts and the room
        const std::uint32_t count = 100'000'000;
        std::memcpy(lie.data() + place, &count, sizeof count);
    }
    expect_harmless("ksplat", lie, "'Gaussians' at byte", status);
    // Rows of 24 bytes become Gaussians of degree 2, which one other section has.
    Buffer wide = sample_ksplat(1, {2, 0});
    const std::uint32_t counts[] = {100'000, 100'000};
    const std::uint32_t all = counts[0] + 5;
    std::memcpy(wide.data() + 16, &all, sizeof all);
    std::memcpy(wide.data() + 4096 + 1024, counts, sizeof counts);
    std::memcpy(wide.data() + 4096 + 1024 + 8, counts, sizeof all);  // size of a full bucket
    wide.resize(wide.size() + std::size_t{24} * (counts[1] - 6));
    expect_harmless("ksplat rows", wide, "read", status);
}

TEST(DecodeBomb, GltfOfBytesThatAreNotThere) {
    SampleGltf sample = sample_gltf();
    sample.length = 4'294'967'296;
    expect_harmless("glb buffer", sample.glb(), "byteLength 4294967296, but only", scene_status);
    sample = sample_gltf();
    for (std::string& accessor : sample.accessors)  // zeros, without a view
        accessor = R"({"componentType":5126,"count":100000000,"type":")" +
                   accessor.substr(accessor.find(R"("type":")") + 8);
    expect_harmless("glb zeros", sample.glb(), "gltf: Gaussians: 100000000 x 56 bytes",
                    scene_status);
}

/// 700,000 instances of a mesh, and a thousand primitives that share the bytes of 16,000 Gaussians.
TEST(DecodeBomb, GltfOfManyInstances) {
    SampleGltf sample = sample_gltf();
    sample.roots = "[0";
    for (int i = 1; i < 700'000; ++i) sample.roots += "," + std::to_string(i);
    sample.roots += "]";
    sample.nodes = repeated(R"([{"mesh":0})", R"(,{"mesh":0})", 699'999, "]");
    SampleGltf large;
    constexpr std::size_t kCount = 16'000;
    const std::vector<float> zeros(4 * kCount, 0.5F);
    large.add<float>("POSITION", {zeros.begin(), zeros.begin() + 3 * kCount}, kGltfFloat, "VEC3",
                     3);
    large.add<float>(gltf_attribute("ROTATION"), zeros, kGltfFloat, "VEC4", 4);
    for (const char* const name : {"SCALE", "SH_DEGREE_0_COEF_0"})
        large.attributes[gltf_attribute(name)] = large.attributes["POSITION"];
    large.add<float>(gltf_attribute("OPACITY"), {zeros.begin(), zeros.begin() + kCount}, kGltfFloat,
                     "SCALAR", 1);
    const std::string whole = large.json();
    const std::size_t at = whole.find(R"({"attributes")");
    const std::string primitive = whole.substr(at, whole.find("]}],\"buffers") - at);
    large.mesh = repeated("", "," + primitive, 999, "");
    const Read read = scene_status;
    expect_harmless("glb nodes", sample.glb(), "read", read);
    expect_harmless("glb shared", large.glb(), "gltf: Gaussians: 16000000 x 56 bytes", read);
    std::string chain = "[{\"mesh\":0}";
    for (int i = 1; i < 500'000; ++i)
        chain += R"(,{"children":[)" + std::to_string(i - 1) + R"(],"scale":[1,1,1]})";
    sample.nodes = chain.substr(0, 15'000'000);
    sample.nodes = sample.nodes.substr(0, sample.nodes.rfind(",{")) + "]";
    sample.roots = "[" + std::to_string(std::ranges::count(sample.nodes, '{') - 1) + "]";
    expect_harmless("glb chain", sample.glb(), "read", read);
}

}  // namespace
}  // namespace splat::io
