#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = x Phi(x);  dy/dx = Phi(x) + x phi(x), because dPhi/dx = phi(x) = exp(-x^2 / 2) / sqrt(2 pi).
/// By tanh: y = x (1 + tanh(u)) / 2 = x s, s = sigmoid(v), v = 2 u = 2 sqrt(2 / pi) (x + 0.044715 x^3);
/// dy/dx = s + x s (1 - s) dv/dx.
///
/// With the tail T = |x| Phi(-|x|), or |x| sigmoid(-|v|), y is max(x, 0) - T. Magnitudes count T, a product of
/// an exponential, a quotient and a polynomial, three times, and by tanh also the roundings of v, of which
/// exp(-|v|) makes |v| times as many.
namespace splat::ref {

template <class Real>
struct GeluPoint {
    Real value;      ///< Phi(x) or s
    Real slope;      ///< x times its derivative
    Real below;      ///< the value at -|x|
    Real roundings;  ///< roundings of the tail
};

template <class Real>
GeluPoint<Real> gelu_point(Real x, bool by_tanh) {
    const Real kPi = std::acos(Real(-1));
    if (!by_tanh) {
        const Real phi = std::exp(-x * x / 2) / std::sqrt(2 * kPi);
        const Real half = 1 / std::sqrt(Real(2));
        return {std::erfc(-x * half) / 2, x * phi, std::erfc(std::abs(x) * half) / 2, 3};
    }
    const Real c = 2 * std::sqrt(2 / kPi);
    const Real v = c * (x + Real(0.044715) * x * x * x);
    const Real s = 1 / (1 + std::exp(-v));
    const Real below = 1 / (1 + std::exp(std::abs(v)));
    return {s, x * s * (1 / (1 + std::exp(v))) * c * (1 + 3 * Real(0.044715) * x * x), below,
            3 + 4 * std::abs(v)};
}

template <class Real>
Summed<Real> gelu_forward(const std::vector<Real>& x, bool by_tanh) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const GeluPoint<Real> at = gelu_point(x[i], by_tanh);
        y.add(i, x[i] * at.value,
              std::max(x[i], Real(0)) + at.roundings * std::abs(x[i]) * at.below);
    }
    return y;
}

template <class Real>
Summed<Real> gelu_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y,
                           bool by_tanh) {
    Summed<Real> grad_x(x.size(), 2);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const GeluPoint<Real> at = gelu_point(x[i], by_tanh);
        grad_x.add(i, grad_y[i] * (at.value + at.slope),
                   std::abs(grad_y[i]) *
                       ((x[i] >= 0 ? 1 : 0) + at.roundings * (at.below + std::abs(at.slope))));
    }
    return grad_x;
}

inline constexpr char kGeluTanh[] = R"({"tanh": true})";

inline constexpr OpRef kGeluRef = elementwise_ref<kGeluTanh>(
    "gelu",
    [](const OpArguments& in) -> Sums { return {gelu_forward(in.values(0), in.flag("tanh"))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {gelu_backward(in.values(0), grads[0], in.flag("tanh"))};
    });

}  // namespace splat::ref
