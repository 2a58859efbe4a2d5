#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

#include "core/status.h"

namespace splat {

inline constexpr std::uint32_t kMaxRank = 8;

/// Shaders index with 32-bit signed integers, so no tensor has 2^31 elements or more.
inline constexpr std::uint64_t kMaxElements = (std::uint64_t{1} << 31) - 1;

/// Dimensions of a row-major tensor, outermost first, each >= 1. Rank 0 is a scalar.
class Shape {
  public:
    Shape() = default;
    Shape(std::initializer_list<std::uint32_t> dims);

    /// Errors: kInvalidArgument for rank > kMaxRank, a dimension < 1, or more than kMaxElements
    /// elements; `what` names the tensor in the message.
    static Result<Shape> create(std::span<const std::int64_t> dims, const std::string& what);

    [[nodiscard]] std::uint32_t rank() const { return rank_; }
    [[nodiscard]] std::uint32_t operator[](std::uint32_t axis) const { return dims_[axis]; }
    [[nodiscard]] std::uint64_t elements() const;
    [[nodiscard]] std::string text() const;  ///< "[1, 3, 128, 128]"

    bool operator==(const Shape&) const = default;

  private:
    std::array<std::uint32_t, kMaxRank> dims_{};
    std::uint32_t rank_ = 0;
};

}  // namespace splat
