#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = x s, s = sigmoid(x);  dy/dx = s + x s (1 - s), because ds/dx = s (1 - s).
///
/// An exponential of own making is a few units off; s feels that by the factor 1 - s, and so the magnitudes
/// hold 3 (1 - s) for it.
namespace splat::ref {

template <class Real>
Summed<Real> silu_forward(const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Real s = 1 / (1 + std::exp(-x[i]));
        y.add(i, x[i] * s, std::abs(x[i] * s) * (1 + 3 * (1 - s)));
    }
    return y;
}

template <class Real>
Summed<Real> silu_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 2);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Real s = 1 / (1 + std::exp(-x[i]));
        const Real slope = s * (1 - s);
        grad_x.add(i, grad_y[i] * (s + x[i] * slope),
                   std::abs(grad_y[i]) * (s + std::abs(x[i]) * slope) * (1 + 3 * (1 - s)));
    }
    return grad_x;
}

inline constexpr OpRef kSiluRef = elementwise_ref<>(
    "silu", [](const OpArguments& in) -> Sums { return {silu_forward(in.values(0))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {silu_backward(in.values(0), grads[0])};
    });

}  // namespace splat::ref
