#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y[i,j] = the greatest of x[2i..2i+1, 2j..2j+1] of each plane; its gradient goes to the first of them.
namespace splat::ref {

struct PoolShape {
    std::size_t planes;
    std::size_t height;  ///< size of x
    std::size_t width;
};

/// Where in x the greatest of a window is.
template <class Real>
std::size_t pool_winner(const PoolShape& s, const std::vector<Real>& x, std::size_t plane,
                        std::size_t i, std::size_t j) {
    std::size_t best = (plane * s.height + 2 * i) * s.width + 2 * j;
    for (std::size_t r = 0; r < 2; ++r)
        for (std::size_t t = 0; t < 2; ++t) {
            const std::size_t at = (plane * s.height + 2 * i + r) * s.width + 2 * j + t;
            if (x[at] > x[best]) best = at;
        }
    return best;
}

template <class Real>
Summed<Real> max_pool2d_forward(const PoolShape& s, const std::vector<Real>& x) {
    Summed<Real> y(s.planes * (s.height / 2) * (s.width / 2), 1);
    std::size_t at = 0;
    for (std::size_t plane = 0; plane < s.planes; ++plane)
        for (std::size_t i = 0; i < s.height / 2; ++i)
            for (std::size_t j = 0; j < s.width / 2; ++j)
                y.add(at++, x[pool_winner(s, x, plane, i, j)]);
    return y;
}

template <class Real>
Summed<Real> max_pool2d_backward(const PoolShape& s, const std::vector<Real>& x,
                                 const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 1);
    std::size_t at = 0;
    for (std::size_t plane = 0; plane < s.planes; ++plane)
        for (std::size_t i = 0; i < s.height / 2; ++i)
            for (std::size_t j = 0; j < s.width / 2; ++j)
                grad_x.add(pool_winner(s, x, plane, i, j), grad_y[at++]);
    return grad_x;
}

inline PoolShape pool_shape(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {x.dim(0) * x.dim(1), x.dim(2), x.dim(3)};
}

inline std::vector<OpExample> pool_example(const Dims& x) {
    return {{.inputs = {{x}}, .outputs = {{x[0], x[1], x[2] / 2, x[3] / 2}}}};
}

inline constexpr OpRef kMaxPool2dRef{
    .name = "max_pool2d",
    .forward = [](const OpArguments& in) -> Sums {
        return {max_pool2d_forward(pool_shape(in), in.values(0))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {max_pool2d_backward(pool_shape(in), in.values(0), grads[0])};
    },
    .examples =
        [] {
            return pool_example({2, 6, 5, 6});
        },
    .sizes =
        [] {
            return pool_example({1, 64, 128, 128});
        }};

}  // namespace splat::ref
