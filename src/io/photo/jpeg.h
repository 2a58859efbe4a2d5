#pragma once

#include "io/image.h"

namespace splat::io {

/// A JPEG file, baseline or progressive, as gray or RGB. Values are as stored; options.upright turns
/// it by its Exif orientation.
///
/// Errors       kFormat if it is not a JPEG, damaged (libjpeg's sentence) or truncated; kUnsupported
///              above the limits and for CMYK
/// Precision    the integer transform of libjpeg-turbo; other decoders may differ by 1 or 2
Result<Image> read_jpeg(Bytes file, const ImageOptions& options = {});

}  // namespace splat::io
