#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/vector.h"

namespace splat::io {

/// Triangles in the units and axes of their file. Every index is below vertices.size().
struct Mesh {
    std::vector<scene::Vec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace splat::io
