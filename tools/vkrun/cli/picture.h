#pragma once

#include <splat.h>

#include <cstdint>
#include <string>
#include <vector>

namespace vkrun {

/// Numbers [height,width,channels] as a picture of the library, which only reads them.
splat_image interleaved_image(const float* values, std::uint32_t width, std::uint32_t height,
                              std::uint32_t channels);

/// The same of bytes, which a call may also fill.
splat_image bytes_image(std::uint8_t* bytes, std::uint32_t width, std::uint32_t height,
                        std::uint32_t channels);

/// The same of planes [channels,side,side]; a call may fill planes that are not const.
splat_image planar_image(const float* planes, std::uint32_t side, std::uint32_t channels);

/// An RGB picture, white where no image was placed.
class Picture {
  public:
    Picture(std::uint32_t width, std::uint32_t height)
        : width_(width), height_(height), rgb_(std::size_t{3} * width * height, 1.0F) {}

    /// Planes [channels,height,width], 1 or 3 channels, with the upper left corner at (x, y).
    void place(const float* planes, std::uint32_t channels, std::uint32_t width,
               std::uint32_t height, std::uint32_t x, std::uint32_t y);

    /// Save a PNG. Throws a Failure.
    void save(const std::string& path) const;

    [[nodiscard]] std::uint32_t width() const { return width_; }
    [[nodiscard]] std::uint32_t height() const { return height_; }

  private:
    std::uint32_t width_, height_;
    std::vector<float> rgb_;
};

/// Rows of a photograph, what was drawn of it and the error, white where there is none or the photograph is black: two
/// views side by side.
class PhotoSheet {
  public:
    /// Planes [3,height,width], which are reduced to at most kMostSide pixels.
    void add(const float* truth, const float* drawn, std::uint32_t width, std::uint32_t height);
    void add(const PhotoSheet& other) {
        cells_.insert(cells_.end(), other.cells_.begin(), other.cells_.end());
    }
    /// Throws a Failure.
    void save(const std::string& path) const;

  private:
    static constexpr std::uint32_t kMostSide = 240;
    struct Cell {
        std::vector<float> planes;
        std::uint32_t width, height;
    };
    std::vector<Cell> cells_;
};

/// Cells of `side` pixels in `columns` columns, `gap` pixels apart; each is [3,side,side], or null for
/// a blank.
Picture contact_sheet(const std::vector<const float*>& cells, std::uint32_t side,
                      std::uint32_t columns, std::uint32_t gap = 4);

}  // namespace vkrun
