#pragma once

#include "api/api_calls.h"

namespace splat::test {

/// Bytes of a picture [24,32,channels]: a dark rectangle on a light ground, in which each pixel differs. Alpha,
/// if there is one, marks the rectangle.
std::vector<std::uint8_t> picture_bytes(std::uint32_t channels);

/// picture_bytes(), or other values of 32 x 24 pixels, as packed pixels.
template <class Value>
splat_image image_of(const std::vector<Value>& values, std::uint32_t channels) {
    return packed_image(values, 32, 24, channels);
}

/// A PNG file of them, removed with the object.
class PictureFile {
  public:
    explicit PictureFile(std::uint32_t channels);
    [[nodiscard]] const char* path() const { return path_.c_str(); }

  private:
    const Temporary path_;
};

}  // namespace splat::test
