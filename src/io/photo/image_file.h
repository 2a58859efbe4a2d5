#pragma once

#include <string>

#include "io/image.h"

namespace splat::io {

/// Whether a name ends as those of images that are read: .png, .jpg, .jpeg, .webp, in any case.
bool is_image_name(const std::string& path);

/// A PNG, JPEG or WebP file, found by its first bytes, whatever its name says. Errors: those of the
/// format, with the path; kInvalidArgument for another format.
Result<Image> load_image(const std::string& path, const ImageOptions& options = {});

}  // namespace splat::io
