#pragma once

#include "io/image.h"

namespace splat::io {

/// What the Exif segment of a JPEG file says, where it is there and not damaged.
struct Exif {
    std::uint32_t orientation = 1;  ///< 1 (upright) to 8
    /// Pixels; 0: not known. From the focal length for 35 mm film, whose diagonal sees the same angle;
    /// else from the focal length and the sensor's pixels per inch or cm.
    double focal = 0;
};

/// Exif data of an image of width x height pixels. Source: CIPA DC-008, tags 274, 37386, 41486, 41488, 41989.
Exif exif_of(Bytes jpeg, std::uint32_t width, std::uint32_t height);

/// The image with rows and columns reordered so that it is upright.
Image upright(Image image, std::uint32_t orientation);

}  // namespace splat::io
