#pragma once

#include <filesystem>
#include <string>

#include "core/os/path.h"
#include "io/camera_set.h"

namespace splat::data {

/// The file that a camera of a folder names: as given, in images/, or with an image's extension added.
/// Errors: kNotFound.
Result<std::string> image_path(const std::filesystem::path& folder, const std::string& name);

/// The cameras of a transforms.json in a folder. Where it gives no size, it is the first image's, where it gives no
/// focal length, that of the image's Exif data.
///
/// Errors       as io::read_transforms_json(), with the file; those of the first image where its size is needed
Result<io::CameraSet> load_transforms(const std::filesystem::path& folder,
                                      const std::filesystem::path& file,
                                      io::CameraOptions options = {});

}  // namespace splat::data
