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

using test::bytes_of;
using test::sample_scene;

const SceneFormat& format_named(const std::string& name) {
    for (const SceneFormat& format : scene_formats())
        if (format.name == name) return format;
    ADD_FAILURE() << "no format " << name;
    return scene_formats()[0];
}

/// A small file of a format that is written, or of compressed .ply.
Buffer sample_file(const SceneFormat& format) {
    if (format.write == nullptr) return test::sample_compressed_ply({});
    const auto file = write_scene(sample_scene(3, format.max_sh_degree), format);
    EXPECT_OK(file.status());
    return file.ok() ? file.value() : Buffer();
}

TEST(SceneFile, EveryFormatIsDetectedReadAndNamed) {
    for (const SceneFormat& format : scene_formats()) {
        if (format.write == nullptr && &format != &format_named("compressed ply")) continue;
        const Buffer file = sample_file(format);
        const std::string name = std::string("a") + format.extension;
        const auto found = detect_scene_format(file, name);
        ASSERT_OK(found.status()) << format.name;
        EXPECT_EQ(found.value()->name, format.name);
        const auto loaded = read_scene(file, name);
        ASSERT_OK(loaded.status()) << format.name;
        EXPECT_EQ(loaded.value().report.format, format.name);
        EXPECT_EQ(loaded.value().report.frame, format.frame) << format.name;
        EXPECT_LE(loaded.value().report.sh_degree, format.max_sh_degree) << format.name;
        if (format.detect == nullptr) continue;
        const auto renamed = detect_scene_format(file, "folder.splat/other");
        ASSERT_OK(renamed.status()) << format.name;
        EXPECT_EQ(renamed.value(), &format) << "the magic identifies it without the name";
    }
}

TEST(SceneFile, ExtensionChoosesTheWriter) {
    for (const SceneFormat& format : scene_formats()) {
        if (format.write == nullptr) continue;
        const auto found = written_scene_format("folder/a" + std::string(format.extension));
        ASSERT_OK(found.status()) << format.name;
        EXPECT_EQ(found.value(), &format);
    }
    EXPECT_EQ(written_scene_format("a.SPZ").value(), &format_named("spz"));
    EXPECT_ERROR(written_scene_format("a.glb").status(), Code::kUnsupported,
                 "'.glb', expected .ply, ");
    EXPECT_ERROR(write_scene(sample_scene(1, 0), format_named("compressed ply")).status(),
                 Code::kUnsupported, "read only; write .ply, ");
}

TEST(SceneFile, OptionsReachTheFormat) {
    SaveOptions newer;
    newer.spz_version = 4;
    const auto file = write_scene(sample_scene(3, 1), format_named("spz"), newer);
    ASSERT_OK(file.status());
    const auto loaded = read_scene(file.value(), "b");
    ASSERT_OK(loaded.status());
    EXPECT_EQ(loaded.value().report.version, 4U);
    LoadOptions few;
    few.max_count = 2;
    EXPECT_ERROR(read_scene(file.value(), "b", few).status(), Code::kUnsupported, "3 Gaussians");
}

TEST(SceneFile, RefusesDegreesThatTheFormatDoesNotHold) {
    SaveOptions options;
    options.sh_degree = 2;
    EXPECT_ERROR(write_scene(sample_scene(1, 2), format_named("splat"), options).status(),
                 Code::kInvalidArgument, "sh_degree 2 to write, but splat holds at most 0");
    EXPECT_OK(write_scene(sample_scene(1, 2), format_named("splat")).status());
    options.sh_degree = 0;
    EXPECT_OK(write_scene(sample_scene(1, 2), format_named("splat"), options).status());
}

TEST(SceneFile, RefusesOtherFiles) {
    const auto refused = [](const std::string& text, const char* name, Code code,
                            const char* part) {
        EXPECT_ERROR(read_scene(bytes_of(text), name).status(), code, part);
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
    const auto file = write_scene(scene, *splat);
    ASSERT_OK(file.status());
    const auto found = detect_scene_format(file.value(), "a.bin");
    ASSERT_OK(found.status());
    ASSERT_EQ(found.value(), &format_named("spz"));
    const auto loaded = read_scene(file.value(), "a.bin", {}, splat);
    ASSERT_OK(loaded.status());
    EXPECT_EQ(loaded.value().report.format, "splat");
    EXPECT_EQ(loaded.value().gaussians.means, scene.means);
    const SceneFormat* const ply = &format_named("ply");
    const auto plain = write_scene(scene, *ply);
    ASSERT_OK(plain.status());
    EXPECT_ERROR(read_scene(plain.value(), "a", {}, &format_named("compressed ply")).status(),
                 Code::kFormat, "'a' is of the format ply, expected compressed ply");
    EXPECT_ERROR(read_scene(bytes_of("abc"), "a.splat", {}, ply).status(), Code::kFormat,
                 "'a.splat': ply: ");
}

TEST(SceneFile, ComesBackFromDisk) {
    const auto scene = sample_scene(5, 2);
    const std::string path = std::filesystem::temp_directory_path() /
                             ("splat-scene-" + std::to_string(getpid()) + ".ply");
    const auto written = write_scene(scene, format_named("ply"));
    ASSERT_OK(written.status());
    ASSERT_OK(write_file(path, written.value()));
    const auto file = io::read_file(path);
    std::filesystem::remove(path);
    ASSERT_OK(file.status());
    const auto loaded = read_scene(file.value(), path);
    ASSERT_OK(loaded.status());
    test::expect_same_bits(loaded.value().gaussians, scene);
    EXPECT_FALSE(io::read_file(path).ok());
    EXPECT_FALSE(write_file("/dev/null/a.ply", written.value()).ok());
}

}  // namespace
}  // namespace splat::io
