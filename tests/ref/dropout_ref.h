#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/rng.h"
#include "ref/summed.h"

/// y = mask x / (1 - p); the gradient is the same map of grad_y. The mask of element (n, c, p) is word
/// c % 4 of philox((quad, step, stream + offset, 0), seed) for its quad in the layout [c/4][n*p].
namespace splat::ref {

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
