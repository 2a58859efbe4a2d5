#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = tanh(x);  dy/dx = 1 - y^2 = 1 / cosh(x)^2, of which nothing cancels.
///
/// Magnitudes count the roundings of an exponential, two sums and a quotient.
namespace splat::ref {

template <class Real>
Summed<Real> tanh_forward(const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i)
        y.add(i, std::tanh(x[i]), 4 * std::abs(std::tanh(x[i])));
    return y;
}

template <class Real>
Summed<Real> tanh_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Real cosh = std::cosh(x[i]);
        const Real term = grad_y[i] / cosh / cosh;
        grad_x.add(i, term, 4 * std::abs(term));
    }
    return grad_x;
}

inline constexpr OpRef kTanhRef = elementwise_ref<>(
    "tanh", [](const OpArguments& in) -> Sums { return {tanh_forward(in.values(0))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {tanh_backward(in.values(0), grads[0])};
    });

}  // namespace splat::ref
