#pragma once

#include <cstddef>
#include <vector>

#include "ref/summed.h"

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

}  // namespace splat::ref
