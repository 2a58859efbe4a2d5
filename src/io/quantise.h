#pragma once

#include <cmath>
#include <cstdint>

#include "scene/activate.h"
#include "scene/gaussians.h"

namespace splat::io {

/// The nearest byte; what is outside 0 to 255 is clamped. NaN gives 0.
inline std::uint8_t to_byte(double value) {
    if (!(value > 0)) return 0;
    return static_cast<std::uint8_t>(value >= 255 ? 255 : std::lround(value));
}

/// Bytes for opacity, and back. 0 and 255 stand for logits of -/+ kMaxOpacityLogit.
inline std::uint8_t opacity_byte(float logit) {
    return to_byte(255 * scene::opacity_of(static_cast<double>(logit)));
}

inline float opacity_logit(std::uint8_t byte) {
    return static_cast<float>(scene::logit_of(byte / 255.0));
}

/// Whether all of `each` values of Gaussian i are finite.
inline bool all_finite(const std::vector<float>& values, std::size_t i, std::size_t each) {
    for (std::size_t k = i * each; k < (i + 1) * each; ++k)
        if (!std::isfinite(values[k])) return false;
    return true;
}

}  // namespace splat::io
