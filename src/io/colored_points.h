#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/vector.h"

namespace splat::io {

/// Points of a file, in its order.
struct ColoredPoints {
    std::vector<scene::Vec3> positions;               ///< what is stored: they may not be finite
    std::vector<std::array<std::uint8_t, 3>> colors;  ///< RGB of each; empty if the file has none
};

}  // namespace splat::io
