#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace splat::io {

/// Numbers that bytes stand for.
using Codebook = std::array<float, 256>;

/// The 256 numbers, in ascending order, to which the values have the least sum of squared distances: exact where
/// there are so few different values, else over at most 2048 groups of neighbours. Without values all are 0. Values
/// are finite.
///
/// Source       Wu 1991, "Optimal quantization by matrix searching": dynamic programming
Codebook make_codebook(std::vector<float> values);

/// The place of the nearest number of a codebook in ascending order.
std::uint8_t nearest_code(const Codebook& codebook, float value);

}  // namespace splat::io
