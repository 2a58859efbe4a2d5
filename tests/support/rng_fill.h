#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace splat::test {

/// SplitMix64: small, seeded, and the same numbers with every standard library, unlike
/// std::normal_distribution.
class Rng {
  public:
    explicit Rng(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {}

    std::uint64_t next() {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
        return z ^ (z >> 31);
    }

    /// In (0, 1).
    double uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1p-53; }

    double normal() {
        const double radius = std::sqrt(-2 * std::log(uniform()));
        return radius * std::cos(2 * std::numbers::pi * uniform());
    }

    /// In [0, below).
    std::uint64_t below(std::uint64_t below) { return next() % below; }

  private:
    std::uint64_t state_;
};

/// Normal numbers, rounded to float, so that the float32 and the float64 computation start from the
/// same values.
inline std::vector<float> normal_fill(std::size_t count, std::uint64_t seed, double mean = 0,
                                      double std = 1) {
    Rng rng(seed);
    std::vector<float> values(count);
    for (float& value : values) value = static_cast<float>(mean + std * rng.normal());
    return values;
}

/// Whole numbers -4 ... 4: their products and sums are exact in float32 while they stay below 2^24.
inline std::vector<float> integer_fill(std::size_t count, std::uint64_t seed) {
    Rng rng(seed);
    std::vector<float> values(count);
    for (float& value : values) value = static_cast<float>(rng.below(9)) - 4.0F;
    return values;
}

/// Contents of fresh memory; results must not depend on them.
inline constexpr std::uint32_t kPoisonPatterns[] = {0x00000000U, 0x7FC0DEADU /* a NaN */,
                                                    0xA5A5A5A5U};

inline std::vector<float> poison_fill(std::size_t count, std::uint32_t pattern) {
    return std::vector<float>(count, std::bit_cast<float>(pattern));
}

inline std::vector<double> to_double(const std::vector<float>& values) {
    return {values.begin(), values.end()};
}

}  // namespace splat::test
