#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Dot-product attention, per image and head (of D = C / heads neighbouring channels):
///
///   s[l,j] = sum_c q[c,l] k[c,j] / sqrt(D)     w[l,j] = exp(s[l,j]) / sum_j exp(s[l,j])
///   y[c,l] = sum_j w[l,j] v[c,j]
///
/// Because dw[l,j]/ds[l,i] = w[l,j] (delta_ij - w[l,i]), the chain rule gives
///
///   grad_v[c,j] = sum_l grad_y[c,l] w[l,j]     grad_w[l,j] = sum_c grad_y[c,l] v[c,j]
///   grad_s[l,j] = w[l,j] (grad_w[l,j] - sum_i w[l,i] grad_w[l,i])
///   grad_q[c,l] = sum_j grad_s[l,j] k[c,j] / sqrt(D)
///   grad_k[c,j] = sum_l grad_s[l,j] q[c,l] / sqrt(D)
///
/// An error of a score multiplies the weight. In the magnitudes each w therefore carries the factor
/// 2 + the magnitude of its row's scores.
namespace splat::ref {

template <class Real>
struct AttentionInput {
    std::size_t n = 1;
    std::size_t c = 1;
    std::size_t heads = 1;
    std::size_t queries = 1;
    std::size_t keys = 1;
    std::vector<Real> q;  ///< [n,c,queries]
    std::vector<Real> k;  ///< [n,c,keys]
    std::vector<Real> v;  ///< [n,c,keys]
};

template <class Real>
struct AttentionBackward {
    Summed<Real> grad_q;
    Summed<Real> grad_k;
    Summed<Real> grad_v;
};

/// The weights of one query, and the factor of their magnitudes.
template <class Real>
struct AttentionRow {
    std::vector<Real> weights;
    Real factor = 0;
};

/// Row of query l of image and head number `batch`.
template <class Real>
AttentionRow<Real> attention_row(const AttentionInput<Real>& in, std::size_t batch, std::size_t l) {
    const std::size_t channels = in.c / in.heads;
    const std::size_t first = batch * channels;  // image * c + head * channels
    const Real scale = 1 / std::sqrt(static_cast<Real>(channels));
    AttentionRow<Real> row{std::vector<Real>(in.keys), 0};
    for (std::size_t j = 0; j < in.keys; ++j) {
        Real magnitude = 0;
        for (std::size_t c = 0; c < channels; ++c) {
            const Real term =
                in.q[(first + c) * in.queries + l] * in.k[(first + c) * in.keys + j] * scale;
            row.weights[j] += term;
            magnitude += std::abs(term);
        }
        row.factor = std::max(row.factor, 2 + magnitude);
    }
    const Real top = *std::max_element(row.weights.begin(), row.weights.end());
    Real sum = 0;
    for (Real& weight : row.weights) sum += weight = std::exp(weight - top);
    for (Real& weight : row.weights) weight /= sum;
    return row;
}

template <class Real>
Summed<Real> attention_forward(const AttentionInput<Real>& in) {
    const std::size_t channels = in.c / in.heads;
    Summed<Real> y(in.n * in.c * in.queries, std::max(in.keys, channels));
    for (std::size_t batch = 0; batch < in.n * in.heads; ++batch)
        for (std::size_t l = 0; l < in.queries; ++l) {
            const AttentionRow<Real> row = attention_row(in, batch, l);
            for (std::size_t c = batch * channels; c < (batch + 1) * channels; ++c)
                for (std::size_t j = 0; j < in.keys; ++j) {
                    const Real term = row.weights[j] * in.v[c * in.keys + j];
                    y.add(c * in.queries + l, term, std::abs(term) * row.factor);
                }
        }
    return y;
}

template <class Real>
AttentionBackward<Real> attention_backward(const AttentionInput<Real>& in,
                                           const std::vector<Real>& grad_y) {
    const std::size_t channels = in.c / in.heads;
    const Real scale = 1 / std::sqrt(static_cast<Real>(channels));
    const std::size_t terms = std::max({in.keys, in.queries, channels});
    AttentionBackward<Real> result{Summed<Real>(in.q.size(), terms),
                                   Summed<Real>(in.k.size(), terms),
                                   Summed<Real>(in.v.size(), terms)};
    for (std::size_t batch = 0; batch < in.n * in.heads; ++batch)
        for (std::size_t l = 0; l < in.queries; ++l) {
            const AttentionRow<Real> row = attention_row(in, batch, l);
            Summed<Real> grad_w(in.keys, channels);
            Real mean = 0;
            Real mean_magnitude = 0;
            for (std::size_t j = 0; j < in.keys; ++j) {
                for (std::size_t c = batch * channels; c < (batch + 1) * channels; ++c) {
                    const Real grad = grad_y[c * in.queries + l];
                    grad_w.add(j, grad * in.v[c * in.keys + j]);
                    result.grad_v.add(c * in.keys + j, grad * row.weights[j],
                                      std::abs(grad) * row.weights[j] * row.factor);
                }
                mean += row.weights[j] * grad_w.value[j];
                mean_magnitude += row.weights[j] * grad_w.magnitude[j];
            }
            for (std::size_t j = 0; j < in.keys; ++j) {
                const Real weight = row.weights[j] * scale;
                const Real grad = weight * (grad_w.value[j] - mean);
                const Real magnitude = weight * (grad_w.magnitude[j] + mean_magnitude) * row.factor;
                for (std::size_t c = batch * channels; c < (batch + 1) * channels; ++c) {
                    const std::size_t at_q = c * in.queries + l;
                    const std::size_t at_k = c * in.keys + j;
                    result.grad_q.add(at_q, grad * in.k[at_k], magnitude * std::abs(in.k[at_k]));
                    result.grad_k.add(at_k, grad * in.q[at_q], magnitude * std::abs(in.q[at_q]));
                }
            }
        }
    return result;
}

inline AttentionInput<double> attention_input(const OpArguments& in) {
    return {in.inputs[0].dim(0),   in.inputs[0].dim(1), in.count("heads"), in.inputs[0].pixels(),
            in.inputs[1].pixels(), in.values(0),        in.values(1),      in.values(2)};
}

inline constexpr OpRef kAttentionRef{
    .name = "attention",
    .forward = [](const OpArguments& in) -> Sums {
        return {attention_forward(attention_input(in))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const auto grad = attention_backward(attention_input(in), grads[0]);
        return {grad.grad_q, grad.grad_k, grad.grad_v};
    },
    .examples = []() -> std::vector<OpExample> {
        const auto example = [](const Dims& q, const Dims& k) -> OpExample {
            return {.inputs = {{q}, {k}, {k}}, .outputs = {q}, .attributes = R"({"heads": 2})"};
        };
        // The weights of the second are just too many to be kept.
        return {example({2, 8, 5, 7}, {2, 8, 33}), example({1, 8, 1451}, {1, 8, 1447})};
    },
    .sizes =
        [] {
            std::vector<OpExample> all;
            for (const Dims& dims : {Dims{1, 256, 16, 16}, Dims{1, 256, 32, 16}})
                all.push_back({.inputs = {{dims}, {dims}, {dims}}, .outputs = {dims}});
            return all;
        }};

}  // namespace splat::ref
