#pragma once

#include <filesystem>
#include <string>

#include "io/image.h"
#include "synthetic/object_writer.h"

namespace splat::test {

/// An empty folder that is removed with the object.
class SampleFolder {
  public:
    SampleFolder();
    SampleFolder(const SampleFolder&) = delete;
    SampleFolder& operator=(const SampleFolder&) = delete;
    ~SampleFolder();

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::filesystem::path& below) const {
        return path_ / below;
    }

  private:
    std::filesystem::path path_;
};

/// Replace or create a file, with its folders.
void put_text(const std::filesystem::path& path, const std::string& text);

/// Replace or create a PNG file, with its folders.
void put_png(const std::filesystem::path& path, const io::Image& image);

/// An 8-bit image of gray, RGB or RGBA; the sample c of column x and row y is 16 y + 4 x + c + first.
void put_image(const std::filesystem::path& path, std::uint32_t size, std::uint32_t channels,
               std::uint32_t first = 0, std::uint8_t alpha = 255);

std::string file_text(const std::filesystem::path& path);

/// Two small training cars of 3 views, one val and one test car of 4.
synthetic::WriterDesc sample_cars(const std::filesystem::path& path);
void write_all(const synthetic::WriterDesc& desc);

/// Maps of four planes beside the images below a folder of such cars, of each view its own.
void put_planes(const std::filesystem::path& root);

}  // namespace splat::test
