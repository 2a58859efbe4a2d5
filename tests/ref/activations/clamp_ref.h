#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y = min(max(x, least), most);  dy/dx = 1 for least <= x <= most, else 0.
namespace splat::ref {

template <class Real>
Summed<Real> clamp_forward(const std::vector<Real>& x, Real least, Real most) {
    Summed<Real> y(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) y.add(i, std::clamp(x[i], least, most));
    return y;
}

template <class Real>
Summed<Real> clamp_backward(const std::vector<Real>& x, const std::vector<Real>& grad_y, Real least,
                            Real most) {
    Summed<Real> grad_x(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i)
        grad_x.add(i, least <= x[i] && x[i] <= most ? grad_y[i] : Real(0));
    return grad_x;
}

inline constexpr char kClampBounds[] = R"({"least": -2, "most": 6.5})";

inline constexpr OpRef kClampRef = elementwise_ref<kClampBounds>(
    "clamp",
    [](const OpArguments& in) -> Sums {
        return {clamp_forward(in.values(0), in.single("least"), in.single("most"))};
    },
    [](const OpArguments& in, const Grads& grads) -> Sums {
        return {clamp_backward(in.values(0), grads[0], in.single("least"), in.single("most"))};
    });

}  // namespace splat::ref
