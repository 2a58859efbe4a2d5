#pragma once

#include <array>
#include <cstdint>

namespace splat {

/// Philox 4x32-10: four random words from a counter and a key, the same as philox() of
/// shaders/include/philox.glsl. It has no state, so that every element of a tensor has its own numbers,
/// whichever thread computes them, and a pass can be repeated.
///
/// Source: Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3".
constexpr std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                              std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = std::uint64_t{0xD2511F53U} * counter[0];
        const std::uint64_t b = std::uint64_t{0xCD9E8D57U} * counter[2];
        counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0],
                   static_cast<std::uint32_t>(b),
                   static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1],
                   static_cast<std::uint32_t>(a)};
        key[0] += 0x9E3779B9U;
        key[1] += 0xBB67AE85U;
    }
    return counter;
}

/// Random numbers from a seed and three words that name a stream, such as those of an object; the same on every
/// machine.
class Random {
  public:
    Random(std::uint64_t seed, std::uint32_t first, std::uint32_t second, std::uint32_t third)
        : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
          words_{first, second, third} {}

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

}  // namespace splat
