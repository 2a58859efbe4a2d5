#pragma once

#include "io/image.h"

namespace splat::io {

/// Orientation from the Exif segment of a JPEG file (tag 274 of CIPA DC-008), 1 to 8; 1 (upright) if it
/// is absent or damaged.
std::uint32_t exif_orientation(Bytes jpeg);

/// The image with rows and columns reordered so that it is upright.
Image upright(Image image, std::uint32_t orientation);

}  // namespace splat::io
