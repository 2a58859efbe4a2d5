#pragma once

#include <cstddef>
#include <vector>

#include "ref/summed.h"

/// y[n] = (a[n], b[n]) along the channels; each gradient is its part of grad_y.
namespace splat::ref {

/// `a` and `b` of n blocks each.
template <class Real>
Summed<Real> concat_forward(std::size_t n, const std::vector<Real>& a, const std::vector<Real>& b) {
    Summed<Real> y(a.size() + b.size(), 1);
    const std::size_t of_a = a.size() / n;
    const std::size_t of_b = b.size() / n;
    for (std::size_t i = 0; i < a.size(); ++i) y.add(i / of_a * (of_a + of_b) + i % of_a, a[i]);
    for (std::size_t i = 0; i < b.size(); ++i)
        y.add(i / of_b * (of_a + of_b) + of_a + i % of_b, b[i]);
    return y;
}

/// The part of `size` elements per block that starts at element `offset` of each of n blocks.
template <class Real>
Summed<Real> concat_backward(std::size_t n, std::size_t offset, std::size_t size,
                             const std::vector<Real>& grad_y) {
    Summed<Real> grad(n * size, 1);
    for (std::size_t i = 0; i < n * size; ++i)
        grad.add(i, grad_y[i / size * (grad_y.size() / n) + offset + i % size]);
    return grad;
}

}  // namespace splat::ref
