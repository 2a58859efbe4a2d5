#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "ref/op_ref.h"

/// y[r, s 2W + j] = cos(2 pi x f_j), y[r, s 2W + W + j] = sin(2 pi x f_j) for feature s and j < W. Backward
/// by the derivatives of sine and cosine. Whole turns are taken off the product first, which is exact in
/// float64 for float32 factors; no error of the argument is granted.
namespace splat::ref {

struct FourierShape {
    std::size_t rows = 1;
    std::size_t features = 1;
    std::size_t waves = 1;

    /// visit(index of x, index of y, number of the frequency, whether a sine) for every value.
    template <class Visit>
    void each(Visit visit) const {
        for (std::size_t i = 0; i < rows * features; ++i)
            for (std::size_t k = 0; k < 2 * waves; ++k)
                visit(i, i * 2 * waves + k, k % waves, k >= waves);
    }
};

template <class Real>
Real fourier_angle(Real x, Real frequency) {
    const Real turns = x * frequency;
    return 2 * std::numbers::pi_v<Real> * (turns - std::round(turns));
}

template <class Real>
Summed<Real> fourier_embedding_forward(const FourierShape& shape, const std::vector<Real>& x,
                                       const std::vector<Real>& frequencies) {
    Summed<Real> y(x.size() * 2 * shape.waves, 1);
    shape.each([&](std::size_t i, std::size_t o, std::size_t j, bool sine) {
        const Real angle = fourier_angle(x[i], frequencies[j]);
        y.add(o, sine ? std::sin(angle) : std::cos(angle), 1);
    });
    return y;
}

template <class Real>
Summed<Real> fourier_embedding_backward(const FourierShape& shape, const std::vector<Real>& x,
                                        const std::vector<Real>& frequencies,
                                        const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), 2 * shape.waves);
    shape.each([&](std::size_t i, std::size_t o, std::size_t j, bool sine) {
        const Real angle = fourier_angle(x[i], frequencies[j]);
        const Real slope = 2 * std::numbers::pi_v<Real> * frequencies[j];
        grad_x.add(i, grad_y[o] * slope * (sine ? std::cos(angle) : -std::sin(angle)),
                   std::abs(grad_y[o] * slope));
    });
    return grad_x;
}

inline FourierShape fourier_shape(const OpArguments& in) {
    return {in.inputs[0].dim(0), in.inputs[0].dim(1), in.inputs[1].dim(0)};
}

inline std::vector<OpExample> fourier_example(std::size_t rows, std::size_t features,
                                              std::size_t waves) {
    return {{.inputs = {{{rows, features}}, {{waves}, 0, 16, true}},
             .outputs = {{rows, features * 2 * waves}}}};
}

inline constexpr OpRef kFourierEmbeddingRef{
    .name = "fourier_embedding",
    .forward = [](const OpArguments& in) -> Sums {
        return {fourier_embedding_forward(fourier_shape(in), in.values(0), in.values(1))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {fourier_embedding_backward(fourier_shape(in), in.values(0), in.values(1), grads[0]),
                {}};
    },
    .examples = [] { return fourier_example(3, 6, 5); },
    .sizes = [] { return fourier_example(64, 1, 128); }};

}  // namespace splat::ref
