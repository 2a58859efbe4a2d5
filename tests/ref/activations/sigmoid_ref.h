#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = s, s = 1 / (1 + exp(-x));  dy/dx = s (1 - s), where 1 - s is sigmoid(-x).
///
/// Magnitudes count the roundings of an exponential, a sum and a quotient.
namespace splat::ref {

template <class Real>
Real logistic(Real x) {
    return 1 / (1 + std::exp(-x));
}

template <class Real>
Summed<Real> sigmoid_forward(const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) y.add(i, logistic(x[i]), 3 * logistic(x[i]));
    return y;
}

template <class Real>
Summed<Real> sigmoid_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Real term = grad_y[i] * logistic(x[i]) * logistic(-x[i]);
        grad_x.add(i, term, 4 * std::abs(term));
    }
    return grad_x;
}

inline constexpr OpRef kSigmoidRef = elementwise_ref<>(
    "sigmoid", [](const OpArguments& in) -> Sums { return {sigmoid_forward(in.values(0))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {sigmoid_backward(in.values(0), grads[0])};
    });

}  // namespace splat::ref
