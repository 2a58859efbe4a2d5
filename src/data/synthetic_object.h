#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/rng.h"
#include "data/solid.h"

namespace splat::data {

/// Numbers from a seed and the words that name an object; the same on every machine.
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

using Solids = std::vector<Solid>;

/// A car that looks along +x and a chair whose sitter looks along +x, z up, in any place and size.
Solids make_car(Random& random);
Solids make_chair(Random& random);

/// RGB of hue, saturation and value, all 0 to 1. One argument, because braces are evaluated in order
/// and arguments are not.
Vec3 hsv(const Vec3& color);

/// The solids with the middle of their bounding box in the origin, in a ball of radius 0.5 that they
/// touch, up to round parts that planes cut.
Solids fitted(const Solids& solids);

}  // namespace splat::data
