#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = exp(x) = dy/dx. Magnitudes count two roundings: of the reduced argument and of the polynomial.
namespace splat::ref {

template <class Real>
Summed<Real> exp_forward(const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) y.add(i, std::exp(x[i]), 2 * std::exp(x[i]));
    return y;
}

template <class Real>
Summed<Real> exp_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i)
        grad_x.add(i, grad_y[i] * std::exp(x[i]), 3 * std::abs(grad_y[i]) * std::exp(x[i]));
    return grad_x;
}

inline constexpr OpRef kExpRef = elementwise_ref<>(
    "exp", [](const OpArguments& in) -> Sums { return {exp_forward(in.values(0))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {exp_backward(in.values(0), grads[0])};
    });

}  // namespace splat::ref
