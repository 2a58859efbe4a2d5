#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/cli/failure.h"

namespace vkrun {

/// Size of an image, in pixels; 0 and 0: not given.
struct ImageSize {
    std::uint32_t width = 0, height = 0;
};

/// "800x600", or an empty text. Throws a usage Failure.
ImageSize image_size(const std::string& text);

/// The cameras of a transforms.json or a COLMAP model.
struct CameraFile {
    std::vector<splat_camera> cameras;
    std::vector<std::string> names;  ///< paths of their images
    std::vector<std::string> warnings;
    /// The same for images of another size, where the file leaves the size open: what differs from
    /// `cameras` follows from the size.
    std::vector<splat_camera> resized;

    [[nodiscard]] bool has_size(std::size_t i) const {
        return cameras[i].width == resized[i].width && cameras[i].height == resized[i].height;
    }
};

struct CameraFileOptions {
    ImageSize size;  ///< size of the images, for cameras whose file does not give it
    bool ignore_distortion = false;
    bool without_size = false;  ///< such cameras need no size and get a placeholder
};

/// The failure to read cameras, in whose sentence `option` replaces the flag that ignores lens distortion; without an
/// option that advice goes.
Failure with_lens_option(const Failure& failure, const std::string& option);

/// Throws a Failure; a usage Failure for a size that is missing, or that no camera needs.
CameraFile load_cameras(const std::string& path, const CameraFileOptions& options);

/// The file or folder that holds the cameras of a folder of photographs: a COLMAP model, else its transforms.json,
/// which `transforms` prefers. Any other path as it is.
std::string cameras_in(const std::string& path, bool transforms = false);

/// Cameras on a circle around a scene. distance: 0: the scene fills the image. Throws a bad-data Failure.
std::vector<splat_camera> orbit_cameras(splat_scene scene, const ImageSize& size,
                                        double elevation_degrees, double distance,
                                        std::uint32_t count);

/// Prints the warnings.
void print_warnings(const CameraFile& file);

/// Throws a bad-data Failure for a camera 1e6 radii of the scene away from it, which is a damaged number rather than a
/// view; a warning if `lenient`.
void check_distance(const std::string& name, const splat_camera& camera,
                    const splat_scene_info& scene, bool lenient);

}  // namespace vkrun
