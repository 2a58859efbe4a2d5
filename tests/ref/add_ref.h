#pragma once

#include <cstddef>
#include <vector>

#include "ref/summed.h"

/// y = scale * (a + b); the gradient of either summand is scale * grad_y.
namespace splat::ref {

template <class Real>
Summed<Real> add_forward(Real scale, const std::vector<Real>& a, const std::vector<Real>& b) {
    Summed<Real> y(a.size(), 2);
    for (std::size_t i = 0; i < a.size(); ++i) {
        y.add(i, scale * a[i]);
        y.add(i, scale * b[i]);
    }
    return y;
}

template <class Real>
Summed<Real> add_backward(Real scale, const std::vector<Real>& grad_y) {
    Summed<Real> grad(grad_y.size(), 1);
    for (std::size_t i = 0; i < grad_y.size(); ++i) grad.add(i, scale * grad_y[i]);
    return grad;
}

}  // namespace splat::ref
