#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = max(x, 0);  dy/dx = 1 for x > 0, else 0.
namespace splat::ref {

template <class Real>
Summed<Real> relu_forward(const std::vector<Real>& x) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) y.add(i, x[i] > 0 ? x[i] : Real(0));
    return y;
}

template <class Real>
Summed<Real> relu_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) grad_x.add(i, x[i] > 0 ? grad_y[i] : Real(0));
    return grad_x;
}

inline constexpr OpRef kReluRef = elementwise_ref<>(
    "relu", [](const OpArguments& in) -> Sums { return {relu_forward(in.values(0))}; },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {relu_backward(in.values(0), grads[0])};
    });

}  // namespace splat::ref
