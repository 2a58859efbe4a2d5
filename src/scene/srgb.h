#pragma once

#include <cmath>

/// The curve of sRGB (IEC 61966-2-1). Beyond 0 to 1 it goes on by the same formulas; NaN stays.
namespace splat::scene {

inline float srgb_of_linear(float value) {
    const auto v = static_cast<double>(value);
    return static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

inline float linear_of_srgb(float value) {
    const auto v = static_cast<double>(value);
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

}  // namespace splat::scene
