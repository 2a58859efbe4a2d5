#pragma once

#include <cstdint>
#include <vector>

#include "core/rng.h"
#include "synthetic/solid.h"

namespace splat::synthetic {

/// Random numbers from a seed and the numbers of an object; the same on every machine.
class Random {
  public:
    Random(std::uint64_t seed, std::uint32_t split, std::uint32_t object, std::uint32_t stream)
        : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
          words_{split, object, stream} {}

    /// In (0, 1).
    double uniform() {
        const auto bits = philox({count_++, words_[0], words_[1], words_[2]}, key_);
        return (bits[0] + 0.5) / 4294967296.0;
    }
    double between(double low, double high) { return low + (high - low) * uniform(); }
    bool chance(double probability) { return uniform() < probability; }
    /// 0 to count - 1
    std::uint32_t choice(std::uint32_t count) {
        return static_cast<std::uint32_t>(uniform() * count);
    }

  private:
    std::array<std::uint32_t, 2> key_;
    std::array<std::uint32_t, 3> words_;
    std::uint32_t count_ = 0;
};

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
