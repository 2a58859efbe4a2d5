#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// loss = mean |a - b|, and by a, with g the gradient by the loss:  g sign(a - b) / elements, 0 where a = b.
/// The rounding of a - b, which |a| + |b| bounds, is in the magnitudes.
namespace splat::ref {

template <class Real>
Summed<Real> l1_forward(const std::vector<Real>& a, const std::vector<Real>& b) {
    Summed<Real> loss(1, a.size());
    const auto elements = static_cast<Real>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Real d = a[i] - b[i];
        const Real wide = std::abs(a[i]) + std::abs(b[i]);
        loss.add(0, (std::abs(d)) / elements, (std::abs(d) + wide) / elements);
    }
    return loss;
}

template <class Real>
Summed<Real> l1_backward(const std::vector<Real>& a, const std::vector<Real>& b, Real grad_loss) {
    Summed<Real> grad_a(a.size(), 2);
    const Real scale = grad_loss / static_cast<Real>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Real d = a[i] - b[i];
        grad_a.add(i, d > 0 ? scale : d < 0 ? -scale : Real(0), std::abs(scale));
    }
    return grad_a;
}

inline constexpr OpRef kL1Ref = image_loss_ref<l1_forward<double>, l1_backward<double>>("l1");

}  // namespace splat::ref
