#pragma once

#include <cstdint>
#include <optional>

namespace splat {

/// a * b, or nothing if it does not fit in 64 bits.
inline std::optional<std::uint64_t> checked_mul(std::uint64_t a, std::uint64_t b) {
    const std::uint64_t product = a * b;
    const bool small = ((a | b) >> 32) == 0;  // spares the division
    if (!small && a != 0 && product / a != b) return std::nullopt;
    return product;
}

/// a + b, or nothing if it does not fit in 64 bits.
inline std::optional<std::uint64_t> checked_add(std::uint64_t a, std::uint64_t b) {
    const std::uint64_t sum = a + b;
    if (sum < a) return std::nullopt;
    return sum;
}

constexpr std::uint64_t ceil_div(std::uint64_t a, std::uint64_t b) {
    return a / b + (a % b != 0);
}

/// The smallest multiple of `step` that is >= a.
constexpr std::uint64_t round_up(std::uint64_t a, std::uint64_t step) {
    return ceil_div(a, step) * step;
}

}  // namespace splat
