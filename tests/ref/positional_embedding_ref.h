#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y[r, s D + j] = cos(x f_j), y[r, s D + D/2 + j] = sin(x f_j) for feature s and j < D/2, with
/// f_j = 10000^(-2j/D); the halves of a row change places if `swap`. Backward by the derivatives of
/// sine and cosine. An error of the argument passes on: the magnitudes hold |x f_j| (1 + j).
namespace splat::ref {

struct EmbeddingShape {
    std::size_t rows = 1;
    std::size_t features = 1;
    std::size_t dimension = 2;
    bool swap = false;

    /// visit(index of x, index of y, frequency, its number, whether a sine) for every value.
    template <class Visit>
    void each(Visit visit) const {
        const std::size_t width = features * dimension;
        const std::size_t waves = dimension / 2;
        for (std::size_t r = 0; r < rows; ++r)
            for (std::size_t c = 0; c < width; ++c) {
                const std::size_t from = swap ? (c + width / 2) % width : c;
                const std::size_t j = from % dimension % waves;
                visit(r * features + from / dimension, r * width + c,
                      std::pow(10000.0,
                               -2.0 * static_cast<double>(j) / static_cast<double>(dimension)),
                      j, from % dimension >= waves);
            }
    }
};

template <class Real>
Summed<Real> positional_embedding_forward(const EmbeddingShape& shape, const std::vector<Real>& x) {
    Summed<Real> y(shape.rows * shape.features * shape.dimension, 1);
    shape.each([&](std::size_t i, std::size_t o, double f, std::size_t j, bool sine) {
        const Real angle = x[i] * f;
        y.add(o, sine ? std::sin(angle) : std::cos(angle),
              1 + std::abs(angle) * static_cast<Real>(1 + j));
    });
    return y;
}

template <class Real>
Summed<Real> positional_embedding_backward(const EmbeddingShape& shape, const std::vector<Real>& x,
                                           const std::vector<Real>& grad_y) {
    Summed<Real> grad_x(x.size(), shape.dimension);
    shape.each([&](std::size_t i, std::size_t o, double f, std::size_t j, bool sine) {
        const Real angle = x[i] * f;
        grad_x.add(i, grad_y[o] * f * (sine ? std::cos(angle) : -std::sin(angle)),
                   std::abs(grad_y[o] * f) * (1 + std::abs(angle) * static_cast<Real>(1 + j)));
    });
    return grad_x;
}

inline EmbeddingShape embedding_shape(const OpArguments& in) {
    return {in.inputs[0].dim(0), in.inputs[0].dim(1), in.count("dimension"),
            in.flag("swap_halves")};
}

inline std::vector<OpExample> embedding_example(std::size_t rows, const char* attributes) {
    return {{.inputs = {{{rows, 6}}}, .outputs = {{rows, 60}}, .attributes = attributes}};
}

inline constexpr OpRef kPositionalEmbeddingRef{
    .name = "positional_embedding",
    .forward = [](const OpArguments& in) -> Sums {
        return {positional_embedding_forward(embedding_shape(in), in.values(0))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {positional_embedding_backward(embedding_shape(in), in.values(0), grads[0])};
    },
    .examples = [] { return embedding_example(3, R"({"dimension": 10, "swap_halves": true})"); },
    .sizes = [] { return embedding_example(64, R"({"dimension": 10})"); }};

}  // namespace splat::ref
