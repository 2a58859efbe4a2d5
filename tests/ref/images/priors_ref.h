#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Pictures to inputs of prior networks and their outputs to maps, as the reference's scripts do it, in plain loops and
/// float64. Images are [height,width,channels].
namespace splat::ref {

struct Pixels {
    std::size_t width = 0, height = 0, channels = 1;
    std::vector<double> values;

    [[nodiscard]] double at(std::ptrdiff_t x, std::ptrdiff_t y, std::size_t c) const {
        const auto column = static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(x, 0, static_cast<std::ptrdiff_t>(width) - 1));
        const auto row = static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(y, 0, static_cast<std::ptrdiff_t>(height) - 1));
        return values[(row * width + column) * channels + c];
    }
};

/// Keys' cubic kernel with a = -0.75.
inline double cubic_kernel(double x) {
    const double a = -0.75, d = std::abs(x);
    if (d <= 1) return (a + 2) * d * d * d - (a + 3) * d * d + 1;
    return d < 2 ? a * d * d * d - 5 * a * d * d + 8 * a * d - 4 * a : 0;
}

/// cv2.resize(INTER_CUBIC), torch's bicubic: sixteen neighbours of (i + 1/2) from / to - 1/2.
inline Pixels cubic_resize(const Pixels& from, std::size_t width, std::size_t height) {
    Pixels to{width, height, from.channels, {}};
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < from.channels; ++c) {
                const double px = (static_cast<double>(x) + 0.5) * static_cast<double>(from.width) /
                                      static_cast<double>(width) -
                                  0.5;
                const double py = (static_cast<double>(y) + 0.5) *
                                      static_cast<double>(from.height) /
                                      static_cast<double>(height) -
                                  0.5;
                double sum = 0;
                const auto fx = static_cast<std::ptrdiff_t>(std::floor(px));
                const auto fy = static_cast<std::ptrdiff_t>(std::floor(py));
                for (std::ptrdiff_t j = fy - 1; j <= fy + 2; ++j)
                    for (std::ptrdiff_t i = fx - 1; i <= fx + 2; ++i)
                        sum += cubic_kernel(px - static_cast<double>(i)) *
                               cubic_kernel(py - static_cast<double>(j)) * from.at(i, j, c);
                to.values.push_back(sum);
            }
    return to;
}

/// Four neighbours of (scale_x x + shift, scale_y y + shift), not before the first pixel.
inline Pixels linear_resize(const Pixels& from, std::size_t width, std::size_t height,
                            double scale_x, double scale_y, double shift) {
    Pixels to{width, height, from.channels, {}};
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < from.channels; ++c) {
                const double px = std::max(0.0, static_cast<double>(x) * scale_x + shift);
                const double py = std::max(0.0, static_cast<double>(y) * scale_y + shift);
                const auto i = static_cast<std::ptrdiff_t>(px), j = static_cast<std::ptrdiff_t>(py);
                const double u = px - std::floor(px), v = py - std::floor(py);
                to.values.push_back(
                    (1 - v) * ((1 - u) * from.at(i, j, c) + u * from.at(i + 1, j, c)) +
                    v * ((1 - u) * from.at(i, j + 1, c) + u * from.at(i + 1, j + 1, c)));
            }
    return to;
}

/// MiDaS's depth map: 255 (v - least) / (greatest - least + 1e-8), truncated.
inline std::vector<std::uint8_t> depth_bytes(const std::vector<double>& v) {
    const auto [least, most] = std::minmax_element(v.begin(), v.end());
    std::vector<std::uint8_t> bytes;
    for (const double value : v)
        bytes.push_back(
            static_cast<std::uint8_t>(255 * (value - *least) / (*most - *least + 1e-8)));
    return bytes;
}

/// Unit normals as bytes: 127.5 (n / |n| + 1), truncated.
inline std::vector<std::uint8_t> normal_bytes(const std::vector<double>& n) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < n.size(); i += 3) {
        const double length =
            std::max(std::sqrt(n[i] * n[i] + n[i + 1] * n[i + 1] + n[i + 2] * n[i + 2]), 1e-12);
        for (std::size_t c = 0; c < 3; ++c)
            bytes.push_back(
                static_cast<std::uint8_t>(std::clamp((n[i + c] / length + 1) * 127.5, 0.0, 255.0)));
    }
    return bytes;
}

/// (v - least) / (greatest - least).
inline void min_max(std::vector<double>& v) {
    const auto [least, most] = std::minmax_element(v.begin(), v.end());
    const double low = *least, range = *most - low;
    for (double& value : v) value = range > 0 ? (value - low) / range : 0;
}

/// The side of MiDaS's Resize: a factor times the side, to the nearest multiple of 32.
inline std::uint32_t midas_side(double side) {
    return static_cast<std::uint32_t>(std::nearbyint(side / 32) * 32);
}

}  // namespace splat::ref
