#pragma once

#include <cstddef>
#include <span>

namespace splat {

/// The index of the first NaN or infinity, or values.size().
std::size_t find_not_finite(std::span<const float> values);

}  // namespace splat
