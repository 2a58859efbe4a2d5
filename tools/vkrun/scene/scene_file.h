#pragma once

#include <string>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

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

/// A table of the formats, for help texts.
std::string scene_formats_text();

constexpr const char* kLenientHelp =
    "Warn of bytes that the header of a .ply or .spz file does\nnot count, instead of refusing the "
    "file";

/// How to read a scene, with or without --lenient.
splat_scene_file_desc scene_file_desc(bool lenient);

/// Throws a Failure. `desc` may be null.
SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc = nullptr);

/// "RUB" and so on; 0 for "auto". Throws a Failure for another word.
splat_frame frame_of(const std::string& name);

}  // namespace vkrun
