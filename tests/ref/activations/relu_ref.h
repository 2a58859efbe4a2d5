#pragma once

#include <cstddef>
#include <vector>

#include "ref/summed.h"

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

}  // namespace splat::ref
