#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/status.h"
#include "io/image.h"

namespace splat::data {

/// Planes of numbers, [channels,height,width].
struct Planes {
    std::uint32_t width = 0, height = 0, channels = 0;
    std::vector<float> values;

    [[nodiscard]] float at(std::uint32_t channel, std::size_t y, std::size_t x) const {
        return values[(std::size_t{channel} * height + y) * width + x];
    }
};

/// Samples of 8 bits, divided by 255.
Planes planes_of(const io::Image& image);

/// Pixels of an image: columns left to left + width - 1, rows top to top + height - 1.
struct PixelBox {
    std::uint32_t left = 0, top = 0, width = 0, height = 0;
};

/// The box of the pixels above 0.4, as left, top, width and height; without any, above a threshold that
/// decreases by 0.05.
std::array<float, 4> foreground_box(const Planes& mask);

/// The box enlarged by 0.3 of its size, within the image. Errors: kFormat for a box without pixels.
Result<PixelBox> crop_box(const std::array<float, 4>& box, std::uint32_t width,
                          std::uint32_t height);

/// Bilinear, without prefilter; pixel centres are at i + 0.5, as in torch's interpolate (align_corners false).
Planes resized_bilinear(const Planes& image, std::uint32_t width, std::uint32_t height);

/// The foreground probability in the whole image as the published preprocessing has it: the box is taken to at most
/// 800 x 800 pixels by the nearest neighbour and back bilinearly; outside it is 0.
Planes mapped_back(const Planes& mask, const PixelBox& box);

/// The largest square around the principal point.
struct PrincipalSquare {
    double x = 0, y = 0;  ///< centre, pixels from the left and the top
    double half_side = 0;
};

/// Errors: kFormat for a centre outside or a square of less than a pixel.
Result<PrincipalSquare> principal_square(const std::array<double, 2>& point, std::uint32_t width,
                                         std::uint32_t height);

/// n x n bilinear samples of the square, n = floor(2 half_side), zero outside the image. The i-th of them lies at
/// x - half_side + 0.5/n + i (2 half_side - 1/n)/(n - 1).
Planes sampled_square(const Planes& image, const PrincipalSquare& square);

/// An image [3,size,size] of a frame, its foreground probability [1,size,size], and both multiplied.
struct PreparedFrame {
    std::vector<float> full, mask, foreground;
};

/// The images of a frame as the published preprocessing makes them.
///
/// Precision    RGB has 8 bits after the square and again after Pillow's LANCZOS. The reference's float32 sums may
///              round the other way where 255 v is a whole number: one level
/// Source       the preprocessing of CO3D of Splatter Image; the loader of PyTorch3D's implicitron
Result<PreparedFrame> prepare_frame(const io::Image& image, const Planes& mask, const PixelBox& box,
                                    const PrincipalSquare& square, std::uint32_t size);

}  // namespace splat::data
