#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ref/adam_ref.h"

/// One Gaussian of a fit in plain float64: a step of Adam on its parameters, and its halves.
namespace splat::ref {

/// mean xyz, logit; log scale xyz, 0; rotation wxyz.
using FitGaussian = std::array<double, 12>;

inline double sigmoid(double x) {
    return 1 / (1 + std::exp(-x));
}

/// Gradient with respect to the parameters from that with respect to mean, opacity, scale and rotation.
inline FitGaussian fit_chain(const FitGaussian& raw, FitGaussian grad) {
    const double opacity = sigmoid(raw[3]);
    grad[3] *= opacity * (1 - opacity);
    for (std::size_t k = 4; k < 7; ++k) grad[k] *= std::exp(raw[k]);
    grad[7] = 0;
    return grad;
}

/// The half on the side of +1 or -1 along the longest axis.
inline FitGaussian fit_half(FitGaussian raw, double side) {
    const auto longest = static_cast<std::size_t>(
        std::max_element(raw.begin() + 4, raw.begin() + 7) - (raw.begin() + 4));
    const double length =
        std::sqrt(raw[8] * raw[8] + raw[9] * raw[9] + raw[10] * raw[10] + raw[11] * raw[11]);
    const double w = raw[8] / length, x = raw[9] / length, y = raw[10] / length,
                 z = raw[11] / length;
    const double columns[3][3] = {
        {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
        {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
        {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
    const double reach = 0.5 * std::exp(raw[4 + longest]);
    for (std::size_t k = 0; k < 3; ++k) {
        raw[k] += side * reach * columns[longest][k];
        raw[4 + k] += std::log(k == longest ? 0.5 : 0.85);
    }
    const double opacity = std::clamp(0.6 * sigmoid(raw[3]), 1e-4, 0.99);
    raw[3] = std::log(opacity / (1 - opacity));
    return raw;
}

}  // namespace splat::ref
