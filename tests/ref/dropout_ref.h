#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ref/summed.h"

/// y = mask x / (1 - p); the gradient is the same map of grad_y. The mask of element (n, c, p) is word
/// c % 4 of philox((quad, step, stream + offset, 0), seed) for its quad in the layout [c/4][n*p].
namespace splat::ref {

/// Philox 4x32-10 (Salmon et al. 2011): ten rounds of two products each, the key growing by constants.
inline std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t first = std::uint64_t{0xD2511F53U} * counter[0];
        const std::uint64_t second = std::uint64_t{0xCD9E8D57U} * counter[2];
        counter = {static_cast<std::uint32_t>(second >> 32) ^ counter[1] ^ key[0],
                   static_cast<std::uint32_t>(second),
                   static_cast<std::uint32_t>(first >> 32) ^ counter[3] ^ key[1],
                   static_cast<std::uint32_t>(first)};
        key = {key[0] + 0x9E3779B9U, key[1] + 0xBB67AE85U};
    }
    return counter;
}

struct DropoutShape {
    std::size_t n = 1;
    std::size_t c = 1;
    std::size_t p = 1;
};

template <class Real>
Summed<Real> dropout(const DropoutShape& shape, double probability, std::uint32_t stream,
                     const std::array<std::uint32_t, 4>& counter, const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const std::size_t channel = i / shape.p % shape.c;
        const std::size_t column = i / shape.p / shape.c * shape.p + i % shape.p;
        const auto quad = static_cast<std::uint32_t>(channel / 4 * shape.n * shape.p + column);
        const auto words =
            philox({quad, counter[2], stream + counter[3], 0}, {counter[0], counter[1]});
        const bool keep = static_cast<double>(words[channel % 4]) * 0x1p-32 >= probability;
        y.add(i, keep ? x[i] / (1 - probability) : Real(0));
    }
    return y;
}

}  // namespace splat::ref
