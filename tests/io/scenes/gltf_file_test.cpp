// Containers, buffers and accessors of glTF: what lies where, and what is refused.

#include <gtest/gtest.h>

#include <filesystem>

#include "io/file.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/scene_formats.h"
#include "io/scenes/gltf.h"
#include "io/scenes/sample_gltf.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::io {
namespace {

using namespace test;

Result<LoadedScene> read_either(Bytes file) {
    return as_text(file).starts_with("glTF") ? read_glb(file) : read_gltf(file);
}

TEST(GltfFile, DamageIsRefusedOrRead) {
    const auto scene = sample_scene(2, 1);
    const Buffer glb = need(write_glb(scene)), gltf = need(write_gltf(scene));
    for (const Buffer& file : {glb, gltf})
        expect_sturdy(file, [](Bytes bytes) { return read_either(bytes).ok(); });
    EXPECT_ERROR(read_gltf(glb), Code::kFormat, "the file is a .glb");
    EXPECT_ERROR(read_glb(gltf), Code::kUnsupported, "glb: version");
}

/// The document with one text in place of another.
Buffer changed(const std::string& from, const std::string& to) {
    SampleGltf sample = sample_gltf();
    std::string json = sample.json();
    const std::size_t at = json.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    json.replace(at, from.size(), to);
    return glb_of({{"JSON", json}, {std::string("BIN\0", 4), std::string(as_text(sample.bytes))}});
}

TEST(GltfFile, NumbersAreCheckedAgainstTheBytes) {
    const struct {
        const char* from;
        const char* to;
        const char* part;
    } rows[] = {
        {R"("byteLength":24})", R"("byteLength":23})", "accessors[0]: 2 elements, 12 bytes apart"},
        {R"("byteLength":24})", R"("byteLength":9007199254740992})",
         "bufferViews[0]: 9007199254740992"},
        {R"("byteOffset":0)", R"("byteOffset":9007199254740992)", "bytes from 9007199254740992 on"},
        {R"("byteOffset":0)", R"("byteOffset":-4)", "byteOffset is none, expected a whole number"},
        {R"("byteOffset":24)", R"("byteOffset":22)", "expected multiples of 4"},
        {R"("byteLength":24})", R"("byteLength":24,"byteStride":8})", "elements of 12 bytes, but"},
        {R"("byteLength":24})", R"("byteLength":24,"byteStride":6})",
         "byteStride 6, expected 4 to 252"},
        {R"("byteLength":24})", R"("byteLength":24,"byteStride":256})", "byteStride 256"},
        {R"("byteLength":24})", R"("byteLength":24,"byteStride":0})", "byteStride 0"},
        {R"("byteLength":24})", R"("byteLength":24,"byteStride":16})",
         "16 bytes apart from byte 0"},
        {R"("count":2)", R"("count":3)", "accessors[0]: 3 elements"},
        {R"("count":2)", R"("count":9007199254740992)", "accessors[0]: 9007199254740992 elements"},
        {R"("count":2)", R"("count":0)", "accessors[0]: count 0"},
        {R"("count":2)", R"("count":1)", "ROTATION: 2 elements, but there are 1 positions"},
        {R"("bufferView":0)", R"("bufferView":9)", "bufferViews[9] is named, but there are 5"},
        {R"("bufferView":0)", R"("bufferView":0,"byteOffset":12)", "from byte 12 on, but"},
        {R"("buffer":0)", R"("buffer":1)", "buffers[1] is named, but there are 1"},
        {R"("buffers":[{"byteLength":)", R"("buffers":[{"byteLength":1)",
         "bytes are there; it is truncated"},
        {R"("POSITION":0)", R"("POSITION":5)", "accessors[5] is named"},
        {R"("POSITION":0)", R"("POSITION":"a")", "POSITION is none, expected a whole number"},
        {R"(,"POSITION":0)", "", "POSITION is missing"},
        {R"("mesh":0)", R"("mesh":1)", "meshes[1] is named"},
        {R"("scene":0)", R"("scene":1)", "scenes[1] is named"},
        {R"("scenes":)", R"("stages":)", "there is no scene"},
        {R"("mode":0)", R"("mode":1)", "mode 1, expected 0"},
        {R"("mode":0,)", "", "mode 4, expected 0"},
        {R"("kernel":"ellipse",)", "", "no kernel, expected 'ellipse'"},
        {R"({"asset":{"version":"2.0"},)", "{", "no asset.version"},
        {R"({"asset":)", R"(["asset":)", "not valid JSON"},
    };
    EXPECT_OK(read_glb(changed("[0]", "[0]")));
    for (const auto& row : rows)
        EXPECT_ERROR(read_glb(changed(row.from, row.to)), Code::kFormat, row.part) << row.to;
    EXPECT_ERROR(read_glb(changed(R"("mode":0)", R"("mode":0,"indices":0)")), Code::kUnsupported,
                 "indices");
    EXPECT_ERROR(read_glb(changed(R"("version":"2.0")", R"("version":"1.0")")), Code::kUnsupported,
                 "version '1.0', expected 2.0");
}

TEST(GltfFile, Chunks) {
    const SampleGltf sample = sample_gltf();
    const std::string json = sample.json(), data(as_text(sample.bytes));
    const std::string binary("BIN\0", 4);
    const auto report =
        need(read_glb(glb_of({{"JSON", json}, {binary, data}, {"more", "abc"}}))).report;
    EXPECT_EQ(report.ignored, std::vector<std::string>{"chunk of type 0x65726f6d"});
    EXPECT_ERROR(read_glb(glb_of({{binary, data}, {"JSON", json}})), Code::kFormat,
                 "the first chunk has type 0x004e4942");
    EXPECT_ERROR(read_glb(glb_of({})), Code::kFormat, "no chunk");
    EXPECT_ERROR(read_glb(glb_of({{"JSON", json}})), Code::kFormat, "buffers[0] has no uri");
    EXPECT_ERROR(read_glb(glb_of({{"JSON", json}, {binary, data}}, 1)), Code::kUnsupported,
                 "version 1");
    Buffer odd = sample.glb();
    odd[12] = static_cast<std::byte>(std::to_integer<unsigned>(odd[12]) - 1);
    EXPECT_ERROR(read_glb(odd), Code::kFormat, "expected a multiple of 4");
    Buffer longer = sample.glb();
    put_text(longer, "abc");
    EXPECT_ERROR(read_glb(longer), Code::kFormat, "3 bytes after the last chunk");
    LoadOptions lenient;
    lenient.lenient = true;
    EXPECT_EQ(need(read_glb(longer, lenient)).report.left_out, "3 bytes after the last chunk");
    for (const std::uint32_t bytes : {0U, 11U}) {
        Buffer wrong = sample.glb();
        std::memcpy(wrong.data() + 8, &bytes, 4);
        EXPECT_ERROR(read_glb(wrong), Code::kFormat, "expected that of the file");
    }
    EXPECT_OK(gltf::check_glb_size(1000, UINT32_MAX - 1028));
    EXPECT_ERROR(gltf::check_glb_size(1000, UINT32_MAX - 1027), Code::kUnsupported,
                 "4294967296 bytes, the format counts them in 32 bits");
}

TEST(GltfFile, StridesAndOffsets) {
    SampleGltf sample = sample_gltf();
    const int view = static_cast<int>(sample.views.size());
    sample.add<float>("", {9, 1, 2, 3, 9, 4, 5, 6}, kGltfFloat, "SCALAR", 1);
    sample.views.back().insert(1, R"("byteStride":16,)");
    sample.accessors.push_back(R"({"bufferView":)" + std::to_string(view) +
                               R"(,"byteOffset":4,"componentType":5126,"count":2,"type":"VEC3"})");
    sample.attributes["POSITION"] = static_cast<int>(sample.accessors.size()) - 1;
    EXPECT_EQ(need(read_glb(sample.glb())).gaussians.means,
              (std::vector<float>{-1, -2, 3, -4, -5, 6}));
}

TEST(GltfFile, SparseAccessors) {
    SampleGltf sample = sample_gltf();
    sample.add<std::uint16_t>("", {1}, kGltfUshort, "SCALAR", 1);
    sample.add<float>("", {7, 8, 9}, kGltfFloat, "VEC3", 3);
    const std::string sparse =
        R"("sparse":{"count":1,"indices":{"bufferView":5,"componentType":5123},)"
        R"("values":{"bufferView":6}}})";
    const auto with = [&](const std::string& base, const std::string& text) {
        SampleGltf changed = sample;
        changed.accessors[0] =
            "{" + base + R"("componentType":5126,"count":2,"type":"VEC3",)" + text;
        return changed.glb();
    };
    EXPECT_EQ(need(read_glb(with(R"("bufferView":0,)", sparse))).gaussians.means,
              (std::vector<float>{-1, -2, 3, -7, -8, 9}));
    EXPECT_EQ(need(read_glb(with("", sparse))).gaussians.means,
              (std::vector<float>{0, 0, 0, -7, -8, 9}))
        << "without a view: zeros";
    const auto refused = [&](const char* from, const char* to, const char* part) {
        std::string text = sparse;
        text.replace(text.find(from), std::string(from).size(), to);
        EXPECT_ERROR(read_glb(with("", text)), Code::kFormat, part);
    };
    refused(R"("count":1)", R"("count":3)", "accessors[0].sparse: count 3, expected 1 to 2");
    refused(R"("count":1)", R"("count":2)", "accessors[0].sparse: 2 elements");
    refused("5123", "5126", "indices of componentType 5126");
    refused(R"("bufferView":6)", R"("bufferView":5)", "accessors[0].sparse: 1 elements, 12 bytes");
    SampleGltf beyond = sample;
    beyond.add<std::uint16_t>("", {2}, kGltfUshort, "SCALAR", 1);
    beyond.add<std::uint16_t>("", {1, 1}, kGltfUshort, "SCALAR", 1);
    beyond.add<float>("", {7, 8, 9, 7, 8, 9}, kGltfFloat, "VEC3", 3);
    sample = beyond;
    refused(R"("bufferView":5)", R"("bufferView":7)",
            "index 0 is 2, expected growing ones below 2");
    std::string twice = sparse;
    twice.replace(twice.find(R"("count":1)"), 9, R"("count":2)");
    twice.replace(twice.find(":5,"), 3, ":8,");
    twice.replace(twice.find(":6}"), 3, ":9}");
    EXPECT_ERROR(read_glb(with("", twice)), Code::kFormat, "index 1 is 1, expected growing ones");
}

TEST(GltfFile, DataUris) {
    SampleGltf sample = sample_gltf();
    const auto with = [&](const std::string& uri) {
        SampleGltf changed = sample;
        changed.buffer = R"(,"uri":")" + uri + '"';
        return bytes_of(changed.json());
    };
    const std::string data = base64(sample.bytes);
    for (const char* const head : {"data:;base64,", "data:application/gltf-buffer;base64,",
                                   "data:application/octet-stream;x=y;base64,"})
        EXPECT_OK(read_gltf(with(head + data)));
    std::string bare = data;
    while (bare.back() == '=') bare.pop_back();
    EXPECT_OK(read_gltf(with("data:;base64," + bare)));
    const auto refused = [&](const std::string& uri, const char* part) {
        EXPECT_ERROR(read_gltf(with(uri)), Code::kFormat, part);
    };
    refused("data:text/plain," + data, "expected 'data:<type>;base64,<data>'");
    refused("data:;base64", "a data URI 'data:;base64'");
    refused("data:;base64,A*==", "character 1 of its base64 is '*'");
    refused("data:;base64,AAAAA", "5 characters of base64");
    refused("data:;base64,AAAA", "byteLength 112, but only 3 bytes are there");
    refused("#0", "the uri '#0' names no bytes");

    // Long data do not count as JSON, whose size is limited, whatever strings lie around them.
    sample.bytes.resize(std::size_t{14} << 20U);
    sample.more = R"(,"extras":"a\"data:\\","extensions":{"x":"data:;base64,\"#0"})";
    const auto loaded = need(read_gltf(sample.gltf()));
    EXPECT_EQ(loaded.gaussians.means, (std::vector<float>{-1, -2, 3, -4, -5, 6}));
    EXPECT_EQ(loaded.report.ignored, std::vector<std::string>{"extras"});
}

class GltfFolder : public FolderTest {
  protected:
    /// Reads a document of this URI, whose bytes lie at data/a b.bin.
    Result<LoadedScene> read(const std::string& uri, const std::optional<std::string>& folder) {
        SampleGltf sample = sample_gltf();
        std::filesystem::create_directories(path("data"));
        EXPECT_OK(write_file(path("data/a b.bin"), sample.bytes));
        sample.buffer = R"(,"uri":")" + uri + '"';
        LoadOptions options;
        options.folder = folder;
        return read_gltf(bytes_of(sample.json()), options);
    }
};

TEST_F(GltfFolder, FilesBesideTheDocument) {
    const std::string here = path("");
    for (const char* const uri : {"data/a b.bin", "data/a%20b.bin", "./data//a%20b.bin"})
        EXPECT_EQ(need(read(uri, here)).gaussians.count(), 2U) << uri;
    EXPECT_ERROR(read("data/a.bin", here), Code::kNotFound, "a.bin");
    EXPECT_ERROR(read("data/a b.bin", std::nullopt), Code::kUnsupported,
                 "the scene is read from memory");
    EXPECT_ERROR(read("data", here), Code::kIo, "");
}

TEST_F(GltfFolder, NoFileOutsideIsOpened) {
    ASSERT_OK(read("data/a b.bin", path("")));
    const std::string inner = path("data/inner");
    std::filesystem::create_directories(inner);
    for (const char* const uri :
         {"../a b.bin", "../a%20b.bin", "%2e%2e/a b.bin", "%2E%2E%2Fa%20b.bin", "x/../../a b.bin",
          "/etc/passwd", "%2Fetc/passwd", "..", "", "c%3Aa.bin", "//host/a.bin"})
        EXPECT_ERROR(read(uri, inner), Code::kFormat, "leads out of the folder") << uri;
    for (const char* const uri : {"file:///etc/passwd", "https://example.org/a.bin", "c:/a.bin"})
        EXPECT_ERROR(read(uri, inner), Code::kFormat, "has a scheme") << uri;
    EXPECT_ERROR(read("..%5Ca b.bin", inner), Code::kFormat, "has a backslash");
    EXPECT_ERROR(read("a%2", inner), Code::kFormat, "has a '%' without digits");
    EXPECT_ERROR(read("a%zz", inner), Code::kFormat, "has a '%' without digits");
    EXPECT_ERROR(read("a%00b", inner), Code::kFormat, "leads out of the folder");
    SPLAT_NEED_LINKS(inner);
    std::filesystem::create_symlink(path("data/a b.bin"), inner + "/link.bin");
    std::filesystem::create_directory_symlink(path("data"), inner + "/up");
    EXPECT_ERROR(read("link.bin", inner), Code::kFormat, "link.bin' is a symbolic link");
    EXPECT_ERROR(read("up/a b.bin", inner), Code::kFormat, "up' is a symbolic link");
}

TEST(GltfFile, WhatIsRefusedOfExtensions) {
    const auto refused = [](const char* list, const char* name, const char* part) {
        SampleGltf sample = sample_gltf();
        sample.more = std::string(",\"") + list + "\":[\"" + name + "\"]";
        if (std::string(list) == "extensionsUsed") sample.used = R"("extras":0)";
        EXPECT_ERROR(read_glb(sample.glb()), Code::kUnsupported, part);
    };
    for (const char* const list : {"extensionsUsed", "extensionsRequired"})
        for (const char* const name : {"KHR_gaussian_splatting_compression_spz_2",
                                       "EXT_meshopt_compression", "KHR_draco_mesh_compression"})
            refused(list, name, (std::string("is packed by ") + name).c_str());
    refused("extensionsRequired", "EXT_mesh_gpu_instancing",
            "the file requires EXT_mesh_gpu_instancing, which is not read");
}

TEST(GltfFile, WhatIsIgnoredIsReported) {
    SampleGltf sample = sample_gltf();
    sample.add<float>("NORMAL", {0, 0, 1, 0, 0, 1}, kGltfFloat, "VEC3", 3);
    sample.add<float>("COLOR_0", {0, 0, 1, 0, 0, 1}, kGltfFloat, "VEC3", 3);
    sample.used = R"("extensionsUsed":["KHR_gaussian_splatting","EXT_mesh_gpu_instancing"],)"
                  R"("extensionsRequired":["KHR_gaussian_splatting","KHR_materials_unlit"])";
    sample.mesh = R"(,{"attributes":{"POSITION":0}})";
    sample.more = R"(,"cameras":[{"type":"perspective","extras":{"a":1}}],"animations":[{}],)"
                  R"("materials":[{}],"skins":[])";
    std::string primitive = sample.primitive;
    primitive.replace(primitive.find("\"kernel"), 18, R"("sortingMethod":"none","kernel":"box")");
    sample.primitive = primitive;
    const std::vector<std::string> expected = {"animations",
                                               "attribute NORMAL",
                                               "cameras",
                                               "extension EXT_mesh_gpu_instancing",
                                               "extension KHR_materials_unlit",
                                               "extras",
                                               "kernel 'box', read as ellipse",
                                               "materials",
                                               "primitives without KHR_gaussian_splatting",
                                               "sortingMethod 'none', read as cameraDistance"};
    EXPECT_EQ(need(read_glb(sample.glb())).report.ignored, expected);
    SampleGltf scenes = sample_gltf();
    std::string json = scenes.json();
    json.replace(json.find(R"("scenes":[)"), 10, R"("scenes":[{},)");
    json.replace(json.find(R"("scene":0)"), 9, R"("scene":1)");
    const auto report =
        need(read_glb(glb_of(
                 {{"JSON", json}, {std::string("BIN\0", 4), std::string(as_text(scenes.bytes))}})))
            .report;
    EXPECT_EQ(report.count, 2U);
    EXPECT_EQ(report.ignored, std::vector<std::string>{"1 scenes that are not shown first"});
}

}  // namespace
}  // namespace splat::io
