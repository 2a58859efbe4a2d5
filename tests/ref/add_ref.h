#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

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

inline OpExample add_example(const Dims& dims) {
    return {.inputs = {{dims}, {dims}}, .outputs = {dims}, .attributes = R"({"scale": 0.5})"};
}

inline constexpr OpRef kAddRef{
    .name = "add",
    .forward = [](const OpArguments& in) -> Sums {
        return {add_forward(in.single("scale"), in.values(0), in.values(1))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const auto grad = add_backward(in.single("scale"), grads[0]);
        return {grad, grad};
    },
    .examples =
        [] {
            return std::vector{add_example({2, 6, 4, 6})};
        },
    .sizes = [] { return at_image_sizes(add_example); }};

}  // namespace splat::ref
