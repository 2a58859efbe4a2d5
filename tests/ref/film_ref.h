#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y[n,c,p] = gamma[n,c] x[n,c,p] + beta[n,c] with modulation [n, 2c] = (gamma, beta), or
/// y = x + beta with modulation [n, c] = beta. By the product rule
///
///   grad_x = gamma grad_y,   grad_gamma = sum_p grad_y x,   grad_beta = sum_p grad_y
namespace splat::ref {

template <class Real>
struct FilmInput {
    std::size_t n = 1;
    std::size_t c = 1;
    std::size_t p = 1;
    bool scaled = true;
    std::vector<Real> x;           ///< [n,c,p]
    std::vector<Real> modulation;  ///< [n,2c], or [n,c] if not scaled

    [[nodiscard]] std::size_t gamma_at(std::size_t plane) const {
        return plane / c * 2 * c + plane % c;
    }
    [[nodiscard]] std::size_t beta_at(std::size_t plane) const {
        return scaled ? gamma_at(plane) + c : plane;
    }
};

template <class Real>
struct FilmBackward {
    Summed<Real> grad_x;
    Summed<Real> grad_modulation;
};

template <class Real>
Summed<Real> film_forward(const FilmInput<Real>& input) {
    Summed<Real> y(input.x.size(), 2);
    for (std::size_t i = 0; i < input.x.size(); ++i) {
        const std::size_t plane = i / input.p;
        const Real gamma = input.scaled ? input.modulation[input.gamma_at(plane)] : Real(1);
        y.add(i, gamma * input.x[i]);
        y.add(i, input.modulation[input.beta_at(plane)]);
    }
    return y;
}

template <class Real>
FilmBackward<Real> film_backward(const FilmInput<Real>& input, const std::vector<Real>& grad_y) {
    FilmBackward<Real> result{Summed<Real>(input.x.size(), 1),
                              Summed<Real>(input.modulation.size(), input.p)};
    for (std::size_t i = 0; i < input.x.size(); ++i) {
        const std::size_t plane = i / input.p;
        const Real gamma = input.scaled ? input.modulation[input.gamma_at(plane)] : Real(1);
        result.grad_x.add(i, gamma * grad_y[i]);
        result.grad_modulation.add(input.beta_at(plane), grad_y[i]);
        if (input.scaled) result.grad_modulation.add(input.gamma_at(plane), grad_y[i] * input.x[i]);
    }
    return result;
}

inline FilmInput<double> film_input(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {x.dim(0), x.dim(1),    x.pixels(), in.inputs[1].dim(1) != x.dim(1),
            x.values, in.values(1)};
}

inline OpExample film_example(const Dims& x, bool scaled = true) {
    return {.inputs = {{x}, {{x[0], scaled ? 2 * x[1] : x[1]}}}, .outputs = {x}};
}

inline constexpr OpRef kFilmRef{
    .name = "film",
    .forward = [](const OpArguments& in) -> Sums { return {film_forward(film_input(in))}; },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const auto grad = film_backward(film_input(in), grads[0]);
        return {grad.grad_x, grad.grad_modulation};
    },
    .examples =
        [] {
            return std::vector{film_example({2, 6, 4, 6}), film_example({2, 6, 4, 6}, false)};
        },
    .sizes = [] { return at_image_sizes([](const Dims& x) { return film_example(x); }); }};

}  // namespace splat::ref
