#pragma once

#include <initializer_list>
#include <string>

#include "io/image.h"

namespace splat::io {

/// The path ends in one of these extensions, in any case.
bool has_extension(const std::string& path, std::initializer_list<std::string_view> extensions);

/// The extension is .png, .jpg, .jpeg, .webp, .pgm or .ppm, in any case.
bool is_image_name(const std::string& path);

/// Names another known format by a file's first bytes, with the command that converts it: "a HEIC file; ...".
/// Else empty.
std::string unread_image(Bytes head);

/// The same of a file; empty also if it cannot be read.
std::string unread_image_file(const std::string& path);

/// A PNG, JPEG, WebP, PGM or PPM file, detected by its first bytes, not its name. Errors: as
/// read_file(), and those of the format with the path; kFormat for another format, with unread_image().
Result<Image> load_image(const std::string& path, const ImageOptions& options = {});

/// The same from bytes. Errors: without a path.
Result<Image> read_image(Bytes file, const ImageOptions& options = {});

}  // namespace splat::io
