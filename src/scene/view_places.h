#pragma once

#include <cstdint>

#include "scene/vector.h"

/// Directions from an object to cameras around it; z is up.
namespace splat::scene {

/// height   z, between -1 and 1
/// azimuth  radians from x, towards y
Vec3 direction_at(double height, double azimuth);

/// View `view` of `count` on a spiral of four turns over the upper half of the sphere, from the horizon to just
/// below the top, as SRN's renders for tests. View 64 of 251, which the published code takes as input, sees the
/// front of an object that faces x, at 45 degrees.
Vec3 spiral_direction(std::uint32_t view, std::uint32_t count);

}  // namespace splat::scene
