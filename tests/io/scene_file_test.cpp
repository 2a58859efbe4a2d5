#include "io/scene_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <filesystem>

#include "io/file.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using namespace test;

const SceneFormat& format_named(const std::string& name) {
    for (const SceneFormat& format : scene_formats())
        if (format.name == name) return format;
    ADD_FAILURE() << "no format " << name;
    return scene_formats()[0];
}

/// A small file of a format that is written, or of compressed .ply.
Buffer sample_file(const SceneFormat& format) {
    if (format.write == nullptr) return sample_compressed_ply({});
    return need(write_scene(sample_scene(3, format.max_sh_degree), format));
}

TEST(SceneFile, EveryFormatIsDetectedReadAndNamed) {
    for (const SceneFormat& format : scene_formats()) {
        SCOPED_TRACE(format.name);
        EXPECT_EQ(format.id, &format - scene_formats().data() + 1) << "ids count from 1";
        if (format.write == nullptr && &format != &format_named("compressed ply")) continue;
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

TEST(SceneFile, ExtensionChoosesTheWriter) {
    for (const SceneFormat& format : scene_formats()) {
        if (format.write == nullptr) continue;
        const auto found = written_scene_format("folder/a" + std::string(format.extension));
        ASSERT_OK(found) << format.name;
        EXPECT_EQ(found.value(), &format);
    }
    EXPECT_EQ(written_scene_format("a.SPZ").value(), &format_named("spz"));
    EXPECT_ERROR(written_scene_format("a.glb"), Code::kUnsupported, "'.glb', expected .ply, ");
    EXPECT_ERROR(write_scene(sample_scene(1, 0), format_named("compressed ply")),
                 Code::kUnsupported, "read only; write .ply, ");
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
    refused("glTF....", "a.glb", Code::kUnsupported, "glTF");
    refused("PK\x03\x04", "a.sog", Code::kUnsupported, "SOG");
    refused("abc", "a.ksplat", Code::kUnsupported, "convert it to .ply, ");
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
    const std::string path = std::filesystem::temp_directory_path() /
                             ("splat-scene-" + std::to_string(getpid()) + ".ply");
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
