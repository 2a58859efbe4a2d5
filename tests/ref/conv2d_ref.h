#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Convolution of stride 1 with R / 2 pixels added to each side, forward and backward, in plain loops.
///
///   y[n,k,i,j] = (sum_{c,r,s} weight[k,c,r,s] * x[n,c,i+r-R/2,j+s-R/2] + bias[k] + residual[n,k,i,j])
///                * scale
///
/// over the taps that lie in the image; if `replicate`, the others read the image's nearest pixel. Each product appears
/// in one y, so with g = scale * grad_y
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
    bool replicate = false;      ///< the border, with R = 3
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
void for_each_product(const Conv2dShape& shape, bool replicate, const Visit& visit) {
    const auto [N, C, H, W, K, R] = shape;
    const auto nearest = [](std::size_t at, std::size_t tap, std::size_t size) {
        const auto last = static_cast<std::ptrdiff_t>(size) - 1;
        const auto to = static_cast<std::ptrdiff_t>(at + tap) - 1;  // R is 3
        return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(to, 0, last));
    };
    for (std::size_t n = 0; n < N; ++n)
        for (std::size_t k = 0; k < K; ++k)
            for (std::size_t c = 0; c < C; ++c)
                for (std::size_t i = 0; i < H; ++i)
                    for (std::size_t j = 0; j < W; ++j)
                        for (std::size_t r = 0; r < R; ++r)
                            for (std::size_t s = 0; s < R; ++s) {
                                std::size_t u = i + r - R / 2;  // wraps far beyond H
                                std::size_t v = j + s - R / 2;
                                if (replicate) u = nearest(i, r, H), v = nearest(j, s, W);
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
    const auto add = [&](std::size_t at_y, std::size_t at_weight, std::size_t at_x) {
        y.add(at_y, input.weight[at_weight] * input.x[at_x] * input.scale);
    };
    for_each_product(input.shape, input.replicate, add);
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
    const auto add = [&](std::size_t at_y, std::size_t at_weight, std::size_t at_x) {
        const Real grad = grad_y[at_y] * input.scale;
        result.grad_x.add(at_x, input.weight[at_weight] * grad);
        result.grad_weight.add(at_weight, input.x[at_x] * grad);
    };
    for_each_product(input.shape, input.replicate, add);
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

inline Conv2dInput<double> conv2d_input(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    const OpTensor& weight = in.inputs[1];
    return {{x.dim(0), x.dim(1), x.dim(2), x.dim(3), weight.dim(0), weight.dim(2)},
            in.single("scale"),
            x.values,
            weight.values,
            in.values(2),
            in.values(3),
            in.flag("replicate")};
}

/// With outputs of order 1.
inline OpExample conv2d_example(const Conv2dShape& s, int winograd, bool plain = true,
                                double scale = 1, bool replicate = false) {
    const Dims x{s.N, s.C, s.H, s.W}, y{s.N, s.K, s.H, s.W};
    const double deviation = 1 / std::sqrt(static_cast<double>(s.R * s.R * s.C));
    return {.inputs = {{x}, {{s.K, s.C, s.R, s.R}, 0, deviation}, {{s.K}, 0, 0.25}, {y}},
            .outputs = {y},
            .attributes = "{\"scale\": " + std::to_string(scale) + ", \"winograd\": " +
                          std::to_string(winograd) + (replicate ? ", \"replicate\": true}" : "}"),
            .title = text_of(x) + " -> " + std::to_string(s.K) +
                     (s.R == 1        ? " 1x1"
                      : winograd == 0 ? ""
                      : winograd == 2 ? " F(2x2)"
                                      : " F(4x4)") +
                     (replicate ? " replicate" : ""),
            .plain = plain};
}

/// The sizes of the network. Plain kernels, which take seconds, run once per size. The 1x1 cases are two of
/// attention and a skip; the last two are an adapter of rank 4.
inline std::vector<OpExample> conv2d_sizes() {
    std::vector<OpExample> all;
    for (const auto& [in, side, out] : {std::array<std::size_t, 3>{128, 128, 128},
                                        {256, 64, 256},
                                        {256, 32, 256},
                                        {512, 32, 256},
                                        {512, 16, 256},
                                        {256, 16, 256}})
        for (const int winograd : {0, 2, 4})
            all.push_back(conv2d_example({1, in, side, side, out, 3}, winograd, winograd == 0));
    for (const Conv2dShape& shape :
         {Conv2dShape{1, 256, 16, 16, 768, 1}, Conv2dShape{1, 256, 16, 16, 256, 1},
          Conv2dShape{1, 512, 32, 32, 256, 1}, Conv2dShape{1, 256, 32, 32, 4, 3},
          Conv2dShape{1, 4, 32, 32, 256, 1}})
        all.push_back(conv2d_example(shape, 0));
    return all;
}

inline constexpr OpRef kConv2dRef{
    .name = "conv2d",
    .forward = [](const OpArguments& in) -> Sums { return {conv2d_forward(conv2d_input(in))}; },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const auto grad = conv2d_backward(conv2d_input(in), grads[0]);
        return {grad.grad_x, grad.grad_weight, grad.grad_bias, grad.grad_residual};
    },
    .examples =
        [] {
            std::vector all = {conv2d_example({1, 17, 9, 9, 12, 3}, 2)};
            for (const int winograd : {0, 2, 4})  // 0: by taps
                all.push_back(conv2d_example({2, 9, 9, 8, 15, 3}, winograd, true, 0.5));
            all.push_back(conv2d_example({2, 9, 9, 8, 17, 3}, 0, true, 0.5));  // directly
            all.push_back(conv2d_example({2, 6, 5, 7, 10, 1}, 0, true, 0.5));
            for (const int winograd : {0, 4})
                all.push_back(conv2d_example({2, 9, 7, 6, 10, 3}, winograd, true, 0.5, true));
            return all;
        },
    .sizes = conv2d_sizes};

}  // namespace splat::ref
