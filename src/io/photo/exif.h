#pragma once

#include "io/image.h"

namespace splat::io {

/// How the camera was held, as the Exif segment of a JPEG file notes it (tag 274 of CIPA DC-008): 1 to 8;
/// 1, upright, where nothing is noted or the note is damaged.
std::uint32_t exif_orientation(Bytes jpeg);

/// The image as its camera saw it: rows and columns in the order that the orientation asks for.
Image upright(Image image, std::uint32_t orientation);

}  // namespace splat::io
