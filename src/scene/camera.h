#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace splat::scene {

/// A pinhole camera. OpenCV axes: x right, y down, z forward; the centre of the pixel in column i
/// and row j is (i + 0.5, j + 0.5).
struct Camera {
    std::string name;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;      ///< pixels
    std::array<double, 16> world_to_camera{};   ///< row-major 4x4, last row 0 0 0 1
};

}  // namespace splat::scene
