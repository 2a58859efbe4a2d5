#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace CLI {
class App;
}

namespace vkrun {

/// A scene file with what the library tells about it.
struct SceneFile {
    Scene scene;
    splat_scene_info info;
    Json report;  ///< result of splat_scene_load_report
};

/// The rows of splat_scene_formats.
const Json& scene_formats();

/// ".ply, .splat or .spz": extensions of all formats, or of those that can be written.
std::string scene_extensions(bool written = false);

/// The row of the format whose extension the name has, the longest of them; null for none.
const Json* named_format(const std::string& path, bool written = false);

/// Whether the path is an unpacked .sog file: its folder, or the meta.json there.
bool is_unpacked_sog(const std::string& path);

/// Bytes of a scene's file, of an unpacked one all files of its folder; 0 where there is none.
std::uint64_t scene_bytes(const std::string& path);

/// The name of a plain .ply of the scene at `path`: "a.ply" of "a.compressed.ply".
std::string plain_ply_name(const std::string& path);

/// A table of the formats, for help texts.
std::string scene_formats_text();

constexpr const char* kLenientHelp =
    "Warn of bytes that the header of a file does not count,\ninstead of refusing the file";

/// How to read a scene, with or without --lenient.
splat_scene_file_desc scene_file_desc(bool lenient);

/// Throws a Failure. `desc` may be null.
SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc = nullptr);

/// Warns of what of a file is ignored.
void warn_ignored(const SceneFile& file, const std::string& path);

/// "antialiased, by distance", or "plain 3DGS".
std::string drawn_as_text(const SceneFile& file);
/// SPLAT_DRAWN_ bits by the names that reports give them: "antialiased", "by distance", "3 sigma", "linear colours".
std::vector<std::string> drawn_names(std::uint32_t bits);

/// --drawn-as, which is "file" by default.
void add_drawn_as_option(CLI::App& command, std::vector<std::string>& words);

/// What such words say: the file's bits, none for "plain", or those of the names. Throws a usage Failure.
std::uint32_t drawn_bits(const std::vector<std::string>& words, std::uint32_t of_file);

/// "RUB" and so on; 0 for "auto". Throws a Failure for another word.
splat_frame frame_of(const std::string& name);
const char* frame_name(splat_frame frame);
std::vector<std::string> frame_names();

}  // namespace vkrun
