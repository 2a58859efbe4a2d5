#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/activations/sigmoid_ref.h"

/// y = log(1 + exp(x)) = max(x, 0) + log(1 + exp(-|x|));  dy/dx = 1 / (1 + exp(-x)).
///
/// Magnitudes count the roundings of an exponential, a quotient and a polynomial in the logarithm.
namespace splat::ref {

template <class Real>
Summed<Real> softplus_forward(const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Real above = std::max(x[i], Real(0));
        const Real rest = std::log1p(std::exp(-std::abs(x[i])));
        y.add(i, above + rest, above + 4 * rest);
    }
    return y;
}

template <class Real>
Summed<Real> softplus_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Real term = grad_y[i] * logistic(x[i]);
        grad_x.add(i, term, 4 * std::abs(term));
    }
    return grad_x;
}

inline constexpr OpRef kSoftplusRef = elementwise_ref<>(
    "softplus", [](const OpArguments& in) -> Sums { return {softplus_forward(in.values(0))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {softplus_backward(in.values(0), grads[0])};
    });

}  // namespace splat::ref
