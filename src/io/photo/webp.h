#pragma once

#include "io/image.h"

namespace splat::io {

/// A WebP file, lossy or lossless, as RGB, or RGBA if it has an alpha channel.
///
/// Errors       kFormat if it is not a WebP, damaged or truncated; kUnsupported above the limits and
///              for animations
Result<Image> read_webp(Bytes file, const ImageOptions& options = {});

}  // namespace splat::io
