#pragma once

#include <filesystem>

#include "api/api_calls.h"

namespace splat::test {

/// Bytes of a picture [24,32,channels]: a dark rectangle on a light ground, in which each pixel differs. Alpha,
/// if there is one, marks the rectangle.
std::vector<std::uint8_t> picture_bytes(std::uint32_t channels);

/// picture_bytes() as packed pixels.
splat_image image_of(std::vector<std::uint8_t>& bytes, std::uint32_t channels);

/// A PNG file of them, removed with the object.
class PictureFile {
  public:
    explicit PictureFile(std::uint32_t channels);
    PictureFile(const PictureFile&) = delete;
    PictureFile& operator=(const PictureFile&) = delete;
    ~PictureFile() { std::filesystem::remove(path_); }

    [[nodiscard]] const char* path() const { return path_.c_str(); }

  private:
    std::string path_;
};

}  // namespace splat::test
