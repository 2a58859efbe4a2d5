#pragma once

#include <string>

#include "io/image.h"

namespace splat::io {

/// The extension is .png, .jpg, .jpeg or .webp, in any case.
bool is_image_name(const std::string& path);

/// A PNG, JPEG or WebP file, detected by its first bytes, not its name. Errors: as
/// read_file(), and those of the format with the path; kFormat for another format.
Result<Image> load_image(const std::string& path, const ImageOptions& options = {});

/// The same from bytes. Errors: without a path.
Result<Image> read_image(Bytes file, const ImageOptions& options = {});

}  // namespace splat::io
