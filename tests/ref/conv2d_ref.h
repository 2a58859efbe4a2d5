#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/summed.h"

/// Convolution of stride 1 with R / 2 zeros on each side, forward and backward, in plain loops.
///
///   y[n,k,i,j] = (sum_{c,r,s} weight[k,c,r,s] * x[n,c,i+r-R/2,j+s-R/2] + bias[k] + residual[n,k,i,j])
///                * scale
///
/// over the taps that lie in the image. Each product appears in one y, so with g = scale * grad_y
///
///   grad_x[n,c,u,v] = sum of weight[k,c,r,s] * g[n,k,i,j] over the products with x[n,c,u,v]
///   grad_weight[k,c,r,s] = sum of x[n,c,i+r-R/2,j+s-R/2] * g[n,k,i,j] over n, i, j
///   grad_bias[k] = sum of g[n,k,i,j] over n, i, j
///   grad_residual = g
namespace splat::ref {

struct Conv2dShape {
    std::size_t N = 1;
    std::size_t C = 1;
    std::size_t H = 1;
    std::size_t W = 1;
    std::size_t K = 1;
    std::size_t R = 3;
};

template <class Real>
struct Conv2dInput {
    Conv2dShape shape;
    Real scale = 1;
    std::vector<Real> x;         ///< [N,C,H,W]
    std::vector<Real> weight;    ///< [K,C,R,R]
    std::vector<Real> bias;      ///< [K], or empty for none
    std::vector<Real> residual;  ///< [N,K,H,W], or empty for none
};

template <class Real>
struct Conv2dBackward {
    Summed<Real> grad_x;         ///< [N,C,H,W]
    Summed<Real> grad_weight;    ///< [K,C,R,R]
    Summed<Real> grad_bias;      ///< [K]
    Summed<Real> grad_residual;  ///< [N,K,H,W]
};

/// Calls visit(element of y, element of weight, element of x) for each product.
template <class Visit>
void for_each_product(const Conv2dShape& shape, const Visit& visit) {
    const auto [N, C, H, W, K, R] = shape;
    for (std::size_t n = 0; n < N; ++n)
        for (std::size_t k = 0; k < K; ++k)
            for (std::size_t c = 0; c < C; ++c)
                for (std::size_t i = 0; i < H; ++i)
                    for (std::size_t j = 0; j < W; ++j)
                        for (std::size_t r = 0; r < R; ++r)
                            for (std::size_t s = 0; s < R; ++s) {
                                const std::size_t u = i + r - R / 2;  // wraps far beyond H
                                const std::size_t v = j + s - R / 2;
                                if (u >= H || v >= W) continue;
                                visit(((n * K + k) * H + i) * W + j, ((k * C + c) * R + r) * R + s,
                                      ((n * C + c) * H + u) * W + v);
                            }
}

/// y [N,K,H,W].
template <class Real>
Summed<Real> conv2d_forward(const Conv2dInput<Real>& input) {
    const auto [N, C, H, W, K, R] = input.shape;
    Summed<Real> y(N * K * H * W, C * R * R + 2);
    for_each_product(input.shape, [&](std::size_t at_y, std::size_t at_weight, std::size_t at_x) {
        y.add(at_y, input.weight[at_weight] * input.x[at_x] * input.scale);
    });
    for (std::size_t i = 0; i < y.value.size(); ++i) {
        if (!input.bias.empty()) y.add(i, input.bias[i / (H * W) % K] * input.scale);
        if (!input.residual.empty()) y.add(i, input.residual[i] * input.scale);
    }
    return y;
}

template <class Real>
Conv2dBackward<Real> conv2d_backward(const Conv2dInput<Real>& input,
                                     const std::vector<Real>& grad_y) {
    const auto [N, C, H, W, K, R] = input.shape;
    Conv2dBackward<Real> result;
    result.grad_x = Summed<Real>(N * C * H * W, K * R * R);
    result.grad_weight = Summed<Real>(K * C * R * R, N * H * W);
    result.grad_bias = Summed<Real>(K, N * H * W);
    result.grad_residual = Summed<Real>(N * K * H * W, 1);
    for_each_product(input.shape, [&](std::size_t at_y, std::size_t at_weight, std::size_t at_x) {
        const Real grad = grad_y[at_y] * input.scale;
        result.grad_x.add(at_x, input.weight[at_weight] * grad);
        result.grad_weight.add(at_weight, input.x[at_x] * grad);
    });
    for (std::size_t i = 0; i < grad_y.size(); ++i) {
        result.grad_bias.add(i / (H * W) % K, grad_y[i] * input.scale);
        result.grad_residual.add(i, grad_y[i] * input.scale);
    }
    return result;
}

/// Winograd's algorithm mixes all pixels of a tile and all taps of a kernel, so that the rounding of
/// an element is bounded by the terms of its neighbours rather than its own: S becomes the largest.
template <class Real>
Summed<Real> mixed(Summed<Real> sums) {
    const Real largest = *std::max_element(sums.magnitude.begin(), sums.magnitude.end());
    std::fill(sums.magnitude.begin(), sums.magnitude.end(), largest);
    return sums;
}

}  // namespace splat::ref
