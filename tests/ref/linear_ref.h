#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Linear layer, forward and backward, in plain loops.
///
///   y[m,o] = sum_i x[m,i] * weight[o,i] + bias[o]
///
/// The loss depends on y alone, so with grad_y[m,o] the chain rule gives
///
///   grad_x[m,i] = sum_o grad_y[m,o] * weight[o,i]
///   grad_weight[o,i] = sum_m grad_y[m,o] * x[m,i]
///   grad_bias[o] = sum_m grad_y[m,o]
namespace splat::ref {

struct LinearShape {
    std::size_t rows = 1;
    std::size_t in = 1;
    std::size_t out = 1;
};

template <class Real>
struct LinearInput {
    LinearShape shape;
    std::vector<Real> x;       ///< [rows,in]
    std::vector<Real> weight;  ///< [out,in]
    std::vector<Real> bias;    ///< [out], or empty for none
};

template <class Real>
struct LinearBackward {
    Summed<Real> grad_x;       ///< [rows,in]
    Summed<Real> grad_weight;  ///< [out,in]
    Summed<Real> grad_bias;    ///< [out]
};

/// y [rows,out].
template <class Real>
Summed<Real> linear_forward(const LinearInput<Real>& input) {
    const auto [rows, in, out] = input.shape;
    Summed<Real> y(rows * out, in + 1);
    for (std::size_t m = 0; m < rows; ++m)
        for (std::size_t o = 0; o < out; ++o) {
            for (std::size_t i = 0; i < in; ++i)
                y.add(m * out + o, input.x[m * in + i] * input.weight[o * in + i]);
            if (!input.bias.empty()) y.add(m * out + o, input.bias[o]);
        }
    return y;
}

template <class Real>
LinearBackward<Real> linear_backward(const LinearInput<Real>& input,
                                     const std::vector<Real>& grad_y) {
    const auto [rows, in, out] = input.shape;
    LinearBackward<Real> result;
    result.grad_x = Summed<Real>(rows * in, out);
    result.grad_weight = Summed<Real>(out * in, rows);
    result.grad_bias = Summed<Real>(out, rows);
    for (std::size_t m = 0; m < rows; ++m)
        for (std::size_t o = 0; o < out; ++o) {
            const Real grad = grad_y[m * out + o];
            result.grad_bias.add(o, grad);
            for (std::size_t i = 0; i < in; ++i) {
                result.grad_x.add(m * in + i, grad * input.weight[o * in + i]);
                result.grad_weight.add(o * in + i, grad * input.x[m * in + i]);
            }
        }
    return result;
}

inline LinearInput<double> linear_input(const OpArguments& in) {
    return {{in.inputs[0].dim(0), in.inputs[0].dim(1), in.inputs[1].dim(0)},
            in.values(0),
            in.values(1),
            in.values(2)};
}

/// With outputs of order 1.
inline OpExample linear_example(std::size_t rows, std::size_t in, std::size_t out) {
    return {
        .inputs = {{{rows, in}},
                   {{out, in}, 0, 1 / std::sqrt(static_cast<double>(in))},
                   {{out}, 0, 0.25}},
        .outputs = {{rows, out}},
        .title = std::to_string(rows) + " x " + std::to_string(in) + "->" + std::to_string(out)};
}

inline constexpr OpRef kLinearRef{
    .name = "linear",
    .forward = [](const OpArguments& in) -> Sums { return {linear_forward(linear_input(in))}; },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const auto grad = linear_backward(linear_input(in), grads[0]);
        return {grad.grad_x, grad.grad_weight, grad.grad_bias};
    },
    .examples =
        [] {  // parts of blocks and tiles in every direction
            return std::vector{linear_example(17, 15, 31), linear_example(67, 63, 33)};
        },
    .sizes =
        [] {  // FiLM of a batch of 4, two layers on the pixels of 32x32 and 64x64 images, and an odd one
            return std::vector{linear_example(4, 512, 512), linear_example(1024, 256, 768),
                               linear_example(4096, 256, 256), linear_example(257, 130, 129)};
        }};

}  // namespace splat::ref
