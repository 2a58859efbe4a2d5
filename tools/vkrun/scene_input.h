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

/// The rows of splat_scene_formats.
const Json& scene_formats();

/// ".ply, .splat or .spz": extensions of all formats, or of those that are written.
std::string scene_extensions(bool written = false);

/// A line for each format, for help texts.
std::string scene_formats_text();

/// Throws a Failure. `desc` may be null.
SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc = nullptr);

/// Of an image, in pixels; 0 and 0: not said.
struct ImageSize {
    std::uint32_t width = 0, height = 0;
};

/// "800x600"; an empty text says nothing. Throws a usage Failure.
ImageSize image_size(const std::string& text);

/// The cameras of a transforms.json or a COLMAP model.
struct CameraFile {
    std::vector<splat_camera> cameras;
    std::vector<std::string> names;  ///< paths of their images
    std::vector<std::string> warnings;
    /// The same for images of another size, where that is not the file's to say: what differs from
    /// `cameras` follows from the size.
    std::vector<splat_camera> resized;

    [[nodiscard]] bool says_size(std::size_t i) const {
        return cameras[i].width == resized[i].width && cameras[i].height == resized[i].height;
    }
};

struct CameraFileOptions {
    ImageSize size;  ///< of the images, for cameras whose file says none
    bool ignore_distortion = false;
    bool without_size = false;  ///< such cameras need no size; they get one to stand in
};

/// Throws a Failure; a usage Failure for a size that is missing, or that no camera needs.
CameraFile load_cameras(const std::string& path, const CameraFileOptions& options);

/// Throws a usage Failure, "--distance is nan, expected ...", unless the value is in the range.
void check_number(const char* option, double value, double least, double most);

/// The same for a colour of three numbers from 0 to 1.
void check_background(const std::vector<float>& rgb);

/// "RUB" and so on; 0 for "auto". Throws a Failure for another word.
splat_frame frame_of(const std::string& name);

/// Throws a usage Failure if the file is there and may not be replaced.
void check_target(const std::string& path, bool overwrite);

}  // namespace vkrun
