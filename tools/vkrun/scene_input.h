#pragma once

#include <string>
#include <vector>

#include "vkrun/device_text.h"
#include "vkrun/objects.h"

namespace vkrun {

using Scene = Owner<splat_scene, splat_scene_destroy>;
using Rasterizer = Owner<splat_rasterizer, splat_rasterizer_destroy>;

/// A scene file with what the library says of it.
struct SceneFile {
    Scene scene;
    splat_scene_info info;
    Json report;  ///< of splat_scene_load_report
};

/// Throws a Failure. `desc` may be null.
SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc = nullptr);

/// The cameras of a transforms.json or a COLMAP model.
struct CameraFile {
    std::vector<splat_camera> cameras;
    std::vector<std::string> names;  ///< paths of their images
    std::vector<std::string> warnings;
};

/// Throws a Failure. Width and height count where the file has none.
CameraFile load_cameras(const std::string& path, std::uint32_t width, std::uint32_t height);

/// "RUB" and so on; 0 for "auto". Throws a Failure for another word.
splat_frame frame_of(const std::string& name);

/// Throws a usage Failure if the file is there and may not be replaced.
void check_target(const std::string& path, bool overwrite);

}  // namespace vkrun
