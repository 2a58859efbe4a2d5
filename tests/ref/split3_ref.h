#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ref/summed.h"

/// part_j[n,c,p] = x[n, 3c + j, p]: a permutation, whose gradient is its inverse.
namespace splat::ref {

/// `parts` of [n,c,p] each.
template <class Real>
std::array<Summed<Real>, 3> split3_forward(std::size_t p, const std::vector<Real>& x) {
    const std::size_t size = x.size() / 3;
    std::array<Summed<Real>, 3> parts;
    for (std::size_t j = 0; j < 3; ++j) {
        parts[j] = Summed<Real>(size, 1);
        for (std::size_t i = 0; i < size; ++i) parts[j].add(i, x[(i / p * 3 + j) * p + i % p]);
    }
    return parts;
}

template <class Real>
Summed<Real> split3_backward(std::size_t p, const std::array<std::vector<Real>, 3>& grads) {
    Summed<Real> grad_x(3 * grads[0].size(), 1);
    for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < grads[j].size(); ++i)
            grad_x.add((i / p * 3 + j) * p + i % p, grads[j][i]);
    return grad_x;
}

}  // namespace splat::ref
