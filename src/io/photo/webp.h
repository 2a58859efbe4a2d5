#pragma once

#include "io/image.h"

namespace splat::io {

/// A WebP file, lossy or lossless, as RGB, or RGBA if it has an alpha channel. What precedes the pixels of a lossless
/// stream is part of the header: it says how much memory libwebp will take.
///
/// Errors       kFormat if it is not a WebP, damaged or truncated; kUnsupported for animations;
///              as check_header()
Result<Image> read_webp(Bytes file, const ImageOptions& options = {});

}  // namespace splat::io
