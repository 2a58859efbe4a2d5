#include "io/scene_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <filesystem>

#include "io/sample_scene.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using test::bytes_of;
using test::sample_scene;

TEST(SceneFile, DetectsByContentThenByName) {
    const auto scene = sample_scene(3, 1);
    for (const auto& [extension, format] :
         {std::pair{"a.ply", SceneFormat::kPly}, std::pair{"a.splat", SceneFormat::kSplat},
          std::pair{"a.SPZ", SceneFormat::kSpz}}) {
        const auto file = write_scene(scene, extension);
        ASSERT_OK(file.status());
        const auto found = detect_scene_format(file.value(), extension);
        ASSERT_OK(found.status());
        EXPECT_EQ(found.value(), format);
        if (format == SceneFormat::kSplat) continue;
        const auto renamed = detect_scene_format(file.value(), "folder.splat/other");
        ASSERT_OK(renamed.status());
        EXPECT_EQ(renamed.value(), format);
    }
    SaveOptions newer;
    newer.spz_version = 4;
    const auto file = write_scene(scene, "a.spz", newer);
    ASSERT_OK(file.status());
    const auto loaded = read_scene(file.value(), "b");
    ASSERT_OK(loaded.status());
    EXPECT_EQ(loaded.value().report.version, 4U);
}

TEST(SceneFile, SaysWhatItDoesNotRead) {
    const auto refused = [](const std::string& text, const char* name, Code code,
                            const char* part) {
        EXPECT_ERROR(read_scene(bytes_of(text), name).status(), code, part);
    };
    refused("glTF....", "a.glb", Code::kUnsupported, "glTF");
    refused("PK\x03\x04", "a.sog", Code::kUnsupported, "SOG");
    refused("abc", "a.ksplat", Code::kUnsupported, "ksplat");
    refused("abc", "a.ply", Code::kInvalidArgument, "'a.ply' is no .ply file");
    refused("abc", "a.spz", Code::kInvalidArgument, "expected gzip");
    refused("abc", "ply", Code::kInvalidArgument, "no scene that is read here");
    refused("", "a.txt", Code::kInvalidArgument, "no scene that is read here");
    refused("abc", "a.splat", Code::kInvalidArgument, "'a.splat': splat: 3 bytes");
    refused("ply\nx", "a.ply", Code::kInvalidArgument, "'a.ply': ply: header line 2");
    EXPECT_ERROR(write_scene(sample_scene(1, 0), "a.glb").status(), Code::kUnsupported, "'glb'");
}

TEST(SceneFile, AFormatThatIsSaidChoosesTheReader) {
    auto scene = sample_scene(3, 0);
    // The first float of a .splat file is a position: here its bytes are the mark of gzip.
    scene.means[0] = std::bit_cast<float>(std::uint32_t{0x41008B1F});
    const auto splat = write_scene(scene, "a.splat");
    ASSERT_OK(splat.status());
    const auto found = detect_scene_format(splat.value(), "a.bin");
    ASSERT_OK(found.status());
    ASSERT_EQ(found.value(), SceneFormat::kSpz);
    const auto loaded = read_scene_as(SceneFormat::kSplat, splat.value(), "a.bin");
    ASSERT_OK(loaded.status());
    EXPECT_EQ(loaded.value().report.format, "splat");
    EXPECT_EQ(loaded.value().gaussians.means, scene.means);
    const auto ply = write_scene(scene, "a.ply");
    ASSERT_OK(ply.status());
    EXPECT_ERROR(read_scene_as(SceneFormat::kCompressedPly, ply.value(), "a").status(),
                 Code::kInvalidArgument, "'a' is of the format ply, expected compressed ply");
    EXPECT_ERROR(read_scene_as(SceneFormat::kPly, bytes_of("abc"), "a.splat").status(),
                 Code::kInvalidArgument, "'a.splat': ply: ");
}

TEST(SceneFile, SavesAndLoads) {
    const auto scene = sample_scene(5, 2);
    const auto path = std::filesystem::temp_directory_path() /
                      ("splat-scene-" + std::to_string(getpid()) + ".ply");
    ASSERT_OK(save_scene(scene, path));
    const auto loaded = load_scene(path);
    std::filesystem::remove(path);
    ASSERT_OK(loaded.status());
    test::expect_same_bits(loaded.value().gaussians, scene);
    EXPECT_FALSE(load_scene(path).ok());
    EXPECT_FALSE(save_scene(scene, "/dev/null/a.ply").ok());
}

}  // namespace
}  // namespace splat::io
