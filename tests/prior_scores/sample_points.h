#pragma once

#include <vector>

#include "scene/vector.h"
#include "support/rng_fill.h"

namespace splat::test {

/// From a normal distribution around the origin.
inline std::vector<scene::Vec3> random_points(std::size_t count, std::uint32_t seed) {
    const std::vector<float> numbers = normal_fill(3 * count, seed, 0, 1);
    std::vector<scene::Vec3> points(count);
    for (std::size_t i = 0; i < 3 * count; ++i)
        points[i / 3][i % 3] = static_cast<double>(numbers[i]);
    return points;
}

}  // namespace splat::test
