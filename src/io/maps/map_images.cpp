#include "io/maps/map_images.h"

#include <algorithm>
#include <limits>

namespace splat::io {
namespace {

std::uint16_t truncated_byte(double value) {
    return static_cast<std::uint16_t>(std::clamp(value, 0.0, 255.0));
}

}  // namespace

Image depth_image(std::span<const float> depths, std::uint32_t width, std::uint32_t height,
                  double far) {
    Image image{width, height, 1, 8, {}};
    const auto inverse = [far](float depth) {
        return 1 / (depth > 0 ? static_cast<double>(depth) : far);
    };
    double low = std::numeric_limits<double>::infinity();
    double high = 0;
    for (const float depth : depths) {
        low = std::min(low, inverse(depth));
        high = std::max(high, inverse(depth));
    }
    for (const float depth : depths)
        image.samples.push_back(truncated_byte(255 * (inverse(depth) - low) / (high - low + 1e-8)));
    return image;
}

Image normal_image(std::span<const float> normals, std::uint32_t width, std::uint32_t height) {
    Image image{width, height, 3, 8, {}};
    for (const float n : normals)
        image.samples.push_back(truncated_byte((static_cast<double>(n) + 1) * 127.5));
    return image;
}

}  // namespace splat::io
