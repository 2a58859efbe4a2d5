#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/summed.h"

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

}  // namespace splat::ref
