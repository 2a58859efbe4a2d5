#pragma once

#include <span>

#include "io/image.h"

/// Maps of 8 bits in the encoding of Splatter Image's data, of numbers that lie [height,width,channels].
namespace splat::io {

/// 1/z scaled to 0 to 255 between the least and the greatest of the image, truncated: larger is nearer. Where `depths`,
/// along z, are 0, nothing is seen, and z is `far`.
Image depth_image(std::span<const float> depths, std::uint32_t width, std::uint32_t height,
                  double far);

/// (n + 1) 127.5, truncated.
Image normal_image(std::span<const float> normals, std::uint32_t width, std::uint32_t height);

}  // namespace splat::io
