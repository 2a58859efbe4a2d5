#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/rng.h"
#include "ref/adam_ref.h"

/// One Gaussian of a fit in plain float64: a step of Adam on its parameters, its halves and shares, noise.
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

/// The axes that it is turned to.
inline std::array<std::array<double, 3>, 3> fit_axes(const FitGaussian& raw) {
    const double length =
        std::sqrt(raw[8] * raw[8] + raw[9] * raw[9] + raw[10] * raw[10] + raw[11] * raw[11]);
    const double w = raw[8] / length, x = raw[9] / length, y = raw[10] / length,
                 z = raw[11] / length;
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
             {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
             {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}}};
}

/// The half on the side of +1 or -1 along the longest axis.
inline FitGaussian fit_half(FitGaussian raw, double side) {
    const auto longest = static_cast<std::size_t>(
        std::max_element(raw.begin() + 4, raw.begin() + 7) - (raw.begin() + 4));
    const auto columns = fit_axes(raw);
    const double reach = 0.5 * std::exp(raw[4 + longest]);
    for (std::size_t k = 0; k < 3; ++k) {
        raw[k] += side * reach * columns[longest][k];
        raw[4 + k] += std::log(k == longest ? 0.5 : 0.85);
    }
    const double opacity = std::clamp(0.6 * sigmoid(raw[3]), 1e-4, 0.99);
    raw[3] = std::log(opacity / (1 - opacity));
    return raw;
}

/// Opacity of one of `copies` in the place of a Gaussian, and the factor of its scales: Kheradmand et al. 2024, eq. 9,
/// as it is written there.
inline std::array<double, 2> fit_share(double opacity, unsigned copies) {
    const double one = 1 - std::pow(1 - opacity, 1.0 / copies);
    double sum = 0;
    for (unsigned i = 1; i <= copies; ++i) {
        double choose = 1;  // i - 1 over k
        for (unsigned k = 0; k < i; ++k) {
            sum += choose * (k % 2 == 0 ? 1 : -1) * std::pow(one, k + 1.0) / std::sqrt(k + 1.0);
            choose = choose * (i - 1 - k) / (k + 1);
        }
    }
    return {one, opacity / sum};
}

/// The mean after noise of factor `scale`, for row `i`: the product of the covariance matrix and three normal numbers.
inline std::array<double, 3> fit_noise(const FitGaussian& raw, double scale, std::uint32_t i,
                                       std::uint32_t step, std::uint32_t seed) {
    const auto words = philox({i, step, 0, 2}, {seed, 0});
    double u[4], eta[3];
    for (std::size_t k = 0; k < 4; ++k) u[k] = (static_cast<double>(words[k] >> 9) + 0.5) / 8388608;
    const double turn = 2 * std::acos(-1.0);
    eta[0] = std::sqrt(-2 * std::log(u[0])) * std::cos(turn * u[2]);
    eta[1] = std::sqrt(-2 * std::log(u[0])) * std::sin(turn * u[2]);
    eta[2] = std::sqrt(-2 * std::log(u[1])) * std::cos(turn * u[3]);
    const double gate = sigmoid(-100 * (sigmoid(raw[3]) - 0.005));
    const auto axes = fit_axes(raw);
    std::array<double, 3> mean = {raw[0], raw[1], raw[2]};
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t k = 0; k < 3; ++k)
                mean[row] += scale * gate * axes[k][row] * axes[k][column] *
                             std::exp(2 * raw[4 + k]) * eta[column];
    return mean;
}

}  // namespace splat::ref
