#pragma once

#include <cstdint>
#include <vector>

#include "core/rng.h"
#include "synthetic/solid.h"

namespace splat::synthetic {

/// The parts of an object.
struct Solids : std::vector<Solid> {
    using std::vector<Solid>::vector;

    /// Between two opposite corners, in any order.
    void box(const Vec3& a, const Vec3& b, const Vec3& color, double bevel = 0) {
        push_back(make_box(glm::min(a, b), glm::max(a, b), color, bevel));
    }
    void cylinder(const Vec3& from, const Vec3& to, double radius, const Vec3& color) {
        push_back(make_cylinder(from, to, radius, color));
    }
    void ellipsoid(const Vec3& center, const Vec3& half, const Vec3& color) {
        push_back(make_ellipsoid(center, half, color));
    }
};

/// A car, and a chair, that face +x with z up, at any place and size.
Solids make_car(Random& random);
Solids make_chair(Random& random);

/// RGB of hue, saturation and value, all 0 to 1. One argument, because the elements of braces are
/// evaluated in order and arguments are not.
Vec3 hsv(const Vec3& color);

/// The solids moved and scaled so that the middle of their bounding box is the origin and they just fit
/// into a ball of radius 0.5. The bounds of round parts ignore the planes that cut them.
Solids fitted(const Solids& solids);

}  // namespace splat::synthetic
