#pragma once

#include <cmath>

/// The curve of sRGB as IEC 61966-2-1 has it, for numbers from 0 on.
namespace splat::ref {

inline double srgb_of_linear(double value) {
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;
}

inline double linear_of_srgb(double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

}  // namespace splat::ref
