#include "io/scene_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <filesystem>

#include "io/file.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "scene/arrays.h"
#include "support/expect_status.h"
#include "support/log_capture.h"
#include "support/system.h"

namespace splat::io {
namespace {

using namespace test;

const SceneFormat& format_named(const std::string& name) {
    for (const SceneFormat& format : scene_formats())
        if (format.name == name) return format;
    ADD_FAILURE() << "no format " << name;
    return scene_formats()[0];
}

/// A small file of a format that is written, or of .ksplat.
Buffer sample_file(const SceneFormat& format) {
    if (format.write == nullptr) return sample_ksplat(1, {2});
    return need(write_scene(sample_scene(3, format.max_sh_degree), format));
}

TEST(SceneFile, EveryFormatIsDetectedReadAndNamed) {
    for (const SceneFormat& format : scene_formats()) {
        SCOPED_TRACE(format.name);
        EXPECT_EQ(format.id, &format - scene_formats().data() + 1) << "ids count from 1";
        if (format.write == nullptr && &format != &format_named("ksplat")) continue;
        const Buffer file = sample_file(format);
        const std::string name = std::string("a") + format.extension;
        EXPECT_EQ(need(detect_scene_format(file, name))->name, format.name);
        const auto loaded = need(read_scene(file, name));
        EXPECT_EQ(loaded.report.format, format.name);
        EXPECT_EQ(loaded.report.frame, format.frame);
        EXPECT_LE(loaded.report.sh_degree, format.max_sh_degree);
        if (format.detect == nullptr) continue;
        const auto renamed = need(detect_scene_format(file, "folder.splat/other"));
        EXPECT_EQ(renamed, &format) << "the magic identifies it without the name";
    }
}

/// Counts the bytes of pieces, and fails at one.
class CountingSink : public ByteSink {
  public:
    explicit CountingSink(std::size_t most) : most_(most) {}
    Status put(Bytes bytes) override {
        largest = std::max(largest, bytes.size());
        put_bytes(file, bytes);
        return ++pieces <= most_ ? Status() : error(Code::kIo, "full");
    }
    Buffer file;
    std::size_t largest = 0, pieces = 0;

  private:
    std::size_t most_;
};

/// Two blocks of the writers and a Gaussian, in another frame and degree than the scene's.
TEST(SceneFile, WritersPutBlockByBlock) {
    const std::size_t count = 2 * kSceneBlock + 1;
    const scene::Gaussians scene = sample_scene(count, 1);
    for (const char* name : {"ply", "splat", "spz"}) {
        SCOPED_TRACE(name);
        const SceneFormat& format = format_named(name);
        SaveOptions options;
        options.frame = scene::Frame::kLuf;
        options.sh_degree = 0;
        CountingSink sink(~std::size_t{0});
        ASSERT_OK(put_scene(scene, format, options, sink));
        EXPECT_EQ(sink.file, need(write_scene(scene, format, options)));
        EXPECT_LT(sink.largest, sink.file.size() / 2);
        LoadOptions back;
        back.frame = options.frame;
        back.limits.times_file = 1000;
        const auto loaded = need(read_scene(sink.file, "a", back, &format)).gaussians;
        ASSERT_EQ(loaded.count(), count);
        // The Gaussians at the ends of blocks are those of a small file.
        const std::vector<std::size_t> ends = {0, kSceneBlock - 1, kSceneBlock, count - 1};
        const auto few = need(write_scene(scene::gather(scene, ends), format, options));
        const auto expected = need(read_scene(few, "a", back, &format)).gaussians;
        const auto found = scene::gather(loaded, ends);
        for (const auto& [what, array, each] : scene::attributes(0))
            EXPECT_EQ(found.*array, expected.*array) << what;
        CountingSink full(sink.pieces - 1);
        EXPECT_ERROR(put_scene(scene, format, options, full), Code::kIo, "full");
    }
}

TEST(SceneFile, ReadersGiveThePagesOfTheFileBack) {
    const scene::Gaussians scene = sample_scene(2 * kSceneBlock, 0);
    for (const char* name : {"ply", "splat"}) {
        SCOPED_TRACE(name);
        const SceneFormat& format = format_named(name);
        const Buffer file = need(write_scene(scene, format));
        Buffer lost = file;
        LoadOptions options;
        options.discard = true;
        const auto loaded = need(read_scene(lost, "a", options, &format)).gaussians;
        EXPECT_EQ(loaded.means, scene.means);
        EXPECT_NE(lost, file) << "nothing was given back";
        const auto kept = need(read_scene(file, "a", {}, &format)).gaussians;
        EXPECT_EQ(kept.rotations, loaded.rotations);
    }
}

TEST(SceneFile, HeadTellsCountAndDegree) {
    for (const SceneFormat& format : scene_formats()) {
        SCOPED_TRACE(format.name);
        if (format.write == nullptr && &format != &format_named("compressed ply")) continue;
        const Buffer file = sample_file(format);
        const auto loaded = need(read_scene(file, "a", {}, &format));
        const SceneHead head = need(read_scene_head(file, "a", {}, &format));
        EXPECT_EQ(head.count, loaded.report.count);
        EXPECT_EQ(head.sh_degree, loaded.report.sh_degree);
        if (format.write == nullptr) continue;
        const Buffer flat = need(write_scene(sample_scene(3, 0), format));
        EXPECT_EQ(need(read_scene_head(flat, "a", {}, &format)).sh_degree, 0U);
    }
    EXPECT_ERROR(read_scene_head(as_bytes("ply\n"), "a"), Code::kFormat, "header");
    LoadOptions few;
    few.max_count = 2;
    EXPECT_ERROR(read_scene_head(sample_file(format_named("ply")), "a", few), Code::kUnsupported,
                 "3 Gaussians, the limit is 2");
}

TEST(SceneFile, ExtensionChoosesTheWriter) {
    for (const SceneFormat& format : scene_formats()) {
        if (format.write == nullptr) continue;
        const auto found = written_scene_format("folder/a" + std::string(format.extension));
        ASSERT_OK(found) << format.name;
        EXPECT_EQ(found.value(), &format);
    }
    EXPECT_EQ(written_scene_format("a.SPZ").value(), &format_named("spz"));
    EXPECT_ERROR(written_scene_format("a.obj"), Code::kUnsupported, "'.obj', expected .ply, ");
    EXPECT_ERROR(write_scene(sample_scene(1, 0), format_named("ksplat")), Code::kUnsupported,
                 "read only; write .ply, ");
}

TEST(SceneFile, TheLongestExtensionCounts) {
    const SceneFormat* const compressed = &format_named("compressed ply");
    const SceneFormat* const plain = &format_named("ply");
    EXPECT_EQ(written_scene_format("a.compressed.ply").value(), compressed);
    EXPECT_EQ(written_scene_format("b/A.b.Compressed.PLY").value(), compressed);
    for (const char* name : {"a.ply", "compressed.ply", "a.compressed/b.ply", "acompressed.ply"})
        EXPECT_EQ(written_scene_format(name).value(), plain) << name;
    EXPECT_ERROR(written_scene_format("a.ply/b"), Code::kUnsupported, "extension ''");
    EXPECT_ERROR(detect_scene_format(bytes_of("abc"), "a.compressed.ply"), Code::kFormat,
                 "is not a .compressed.ply file");
    // The header tells, whatever the name.
    const auto file = need(write_scene(sample_scene(1, 0), *plain));
    EXPECT_EQ(need(detect_scene_format(file, "a.compressed.ply")), plain);
    EXPECT_EQ(need(detect_scene_format(sample_compressed_ply({}), "a.ply")), compressed);
}

TEST(SceneFile, WarnsOfDrawingThatAFormatDoesNotSay) {
    auto scene = sample_scene(2, 0);
    scene.drawn_as = {true, true, true, true};
    for (const SceneFormat& format : scene_formats()) {
        if (format.write == nullptr) continue;
        const LogCapture log;
        const auto file = need(write_scene(scene, format));
        const auto said = need(format.read(file, {})).report.drawn_as;
        EXPECT_EQ(said, format.says) << format.name;
        for (const std::string& name : scene::drawn_as_names(scene.drawn_as)) {
            const auto names = scene::drawn_as_names(said);
            EXPECT_EQ(log.text().find("drawn with '" + name + "'") == std::string::npos,
                      std::ranges::find(names, name) != names.end())
                << format.name << ": " << log.text();
        }
        const LogCapture none;
        EXPECT_OK(write_scene(sample_scene(2, 0), format));
        EXPECT_EQ(none.text().empty(), format.always == scene::DrawnAs()) << none.text();
    }
}

TEST(SceneFile, OptionsReachTheFormat) {
    SaveOptions newer;
    newer.spz_version = 4;
    const auto file = need(write_scene(sample_scene(3, 1), format_named("spz"), newer));
    EXPECT_EQ(need(read_scene(file, "b")).report.version, 4U);
    LoadOptions few;
    few.max_count = 2;
    EXPECT_ERROR(read_scene(file, "b", few), Code::kUnsupported, "3 Gaussians");
}

TEST(SceneFile, RefusesDegreesThatTheFormatDoesNotHold) {
    SaveOptions options;
    options.sh_degree = 2;
    EXPECT_ERROR(write_scene(sample_scene(1, 2), format_named("splat"), options),
                 Code::kInvalidArgument, "sh_degree 2 to write, but splat holds at most 0");
    EXPECT_OK(write_scene(sample_scene(1, 2), format_named("splat")));
    options.sh_degree = 0;
    EXPECT_OK(write_scene(sample_scene(1, 2), format_named("splat"), options));
}

TEST(SceneFile, RefusesOtherFiles) {
    const auto refused = [](const std::string& text, const char* name, Code code,
                            const char* part) {
        EXPECT_ERROR(read_scene(bytes_of(text), name), code, part);
    };
    refused("glTF....", "a.glb", Code::kFormat, "'a.glb': glb: 'length' at byte 8");
    refused("glTF", "a.gltf", Code::kFormat, "'a.gltf': glb: 'version'");
    refused("{}", "a.gltf", Code::kFormat, "'a.gltf': gltf: there is no asset.version");
    refused("PK\x03\x04", "a.npz", Code::kFormat, "sog: there is no end-of-directory record");
    refused("{}", "meta.json", Code::kFormat, "not a scene of a known format");
    refused("{}", "a.sog", Code::kFormat, "'a.sog' is not a .sog file");
    refused("abc", "a.ksplat", Code::kFormat, "'a.ksplat': ksplat: 'header' at byte 0 needs");
    refused("abc", "a.ply", Code::kFormat, "'a.ply' is not a .ply file");
    refused("abc", "a.spz", Code::kFormat, "expected gzip");
    refused("abc", "ply", Code::kFormat, "not a scene of a known format");
    refused("", "a.txt", Code::kFormat, "expected .ply, ");
    refused("abc", "a.splat", Code::kFormat, "'a.splat': splat: 3 bytes");
    refused("ply\nx", "a.ply", Code::kFormat, "'a.ply': ply: header line 2");
}

TEST(SceneFile, AGivenFormatChoosesTheReader) {
    auto scene = sample_scene(3, 0);
    // The first float of a .splat file is a position. Here its bytes are the magic of gzip.
    scene.means[0] = std::bit_cast<float>(std::uint32_t{0x41008B1F});
    const SceneFormat* const splat = &format_named("splat");
    const auto file = need(write_scene(scene, *splat));
    ASSERT_EQ(need(detect_scene_format(file, "a.bin")), &format_named("spz"));
    const auto loaded = need(read_scene(file, "a.bin", {}, splat));
    EXPECT_EQ(loaded.report.format, "splat");
    EXPECT_EQ(loaded.gaussians.means, scene.means);
    const SceneFormat* const ply = &format_named("ply");
    const auto plain = need(write_scene(scene, *ply));
    EXPECT_ERROR(read_scene(plain, "a", {}, &format_named("compressed ply")), Code::kFormat,
                 "'a' is of the format ply, expected compressed ply");
    EXPECT_ERROR(read_scene(bytes_of("abc"), "a.splat", {}, ply), Code::kFormat,
                 "'a.splat': ply: ");
}

TEST(SceneFile, ComesBackFromDisk) {
    const auto scene = sample_scene(5, 2);
    const std::string path =
        (std::filesystem::temp_directory_path() / ("splat-scene-" + test::process_text() + ".ply"))
            .string();
    const auto written = need(write_scene(scene, format_named("ply")));
    ASSERT_OK(write_file(path, written));
    const auto file = need(io::read_file(path));
    std::filesystem::remove(path);
    const auto loaded = need(read_scene(file, path));
    expect_same_bits(loaded.gaussians, scene);
    EXPECT_FALSE(io::read_file(path).ok());
    EXPECT_FALSE(write_file("/dev/null/a.ply", written).ok());
}

}  // namespace
}  // namespace splat::io
