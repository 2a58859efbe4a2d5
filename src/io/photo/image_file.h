#pragma once

#include <string>

#include "io/image.h"

namespace splat::io {

/// The extension is .png, .jpg, .jpeg or .webp, in any case.
bool is_image_name(const std::string& path);

/// A PNG, JPEG or WebP file, detected by its first bytes, not its name. Errors: those of the
/// format, with the path; kInvalidArgument for another format.
Result<Image> load_image(const std::string& path, const ImageOptions& options = {});

}  // namespace splat::io
