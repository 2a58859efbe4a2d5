#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y[n] = (a[n], b[n]) along the channels; each gradient is its part of grad_y.
namespace splat::ref {

/// `a` and `b` of n blocks each.
template <class Real>
Summed<Real> concat_forward(std::size_t n, const std::vector<Real>& a, const std::vector<Real>& b) {
    Summed<Real> y(a.size() + b.size(), 1);
    const std::size_t of_a = a.size() / n;
    const std::size_t of_b = b.size() / n;
    for (std::size_t i = 0; i < a.size(); ++i) y.add(i / of_a * (of_a + of_b) + i % of_a, a[i]);
    for (std::size_t i = 0; i < b.size(); ++i)
        y.add(i / of_b * (of_a + of_b) + of_a + i % of_b, b[i]);
    return y;
}

/// The part of `size` elements per block that starts at element `offset` of each of n blocks.
template <class Real>
Summed<Real> concat_backward(std::size_t n, std::size_t offset, std::size_t size,
                             const std::vector<Real>& grad_y) {
    Summed<Real> grad(n * size, 1);
    for (std::size_t i = 0; i < n * size; ++i)
        grad.add(i, grad_y[i / size * (grad_y.size() / n) + offset + i % size]);
    return grad;
}

inline OpExample concat_example(const Dims& a, const Dims& b) {
    Dims y = a;
    y[1] += b[1];
    return {.inputs = {{a}, {b}}, .outputs = {y}, .title = text_of(a) + " " + text_of(b)};
}

inline constexpr OpRef kConcatRef{
    .name = "concat",
    .forward = [](const OpArguments& in) -> Sums {
        return {concat_forward(in.inputs[0].dim(0), in.values(0), in.values(1))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const std::size_t n = in.inputs[0].dim(0);
        const std::size_t a = in.values(0).size() / n;
        return {concat_backward(n, 0, a, grads[0]),
                concat_backward(n, a, in.values(1).size() / n, grads[0])};
    },
    .examples =
        [] {  // copies, and kernels
            return std::vector{concat_example({2, 4, 6}, {2, 6, 6}),
                               concat_example({2, 5, 6}, {2, 6, 6})};
        },
    .sizes =
        [] { return at_image_sizes([](const Dims& dims) { return concat_example(dims, dims); }); }};

}  // namespace splat::ref
