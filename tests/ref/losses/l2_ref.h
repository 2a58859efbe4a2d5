#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// loss = mean (a - b)^2, and by a, with g the gradient by the loss:  g 2 (a - b) / elements.
/// The rounding of a - b, which |a| + |b| bounds, is in the magnitudes.
namespace splat::ref {

template <class Real>
Summed<Real> l2_forward(const std::vector<Real>& a, const std::vector<Real>& b) {
    Summed<Real> loss(1, a.size());
    const auto elements = static_cast<Real>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Real d = a[i] - b[i];
        const Real wide = std::abs(a[i]) + std::abs(b[i]);
        loss.add(0, (d * d) / elements, (2 * std::abs(d) * wide + d * d) / elements);
    }
    return loss;
}

template <class Real>
Summed<Real> l2_backward(const std::vector<Real>& a, const std::vector<Real>& b, Real grad_loss) {
    Summed<Real> grad_a(a.size(), 2);
    const Real scale = grad_loss / static_cast<Real>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Real d = a[i] - b[i];
        const Real wide = std::abs(a[i]) + std::abs(b[i]);
        grad_a.add(i, 2 * d * scale, 2 * wide * std::abs(scale));
    }
    return grad_a;
}

inline constexpr OpRef kL2Ref = image_loss_ref<l2_forward<double>, l2_backward<double>>("l2");

}  // namespace splat::ref
