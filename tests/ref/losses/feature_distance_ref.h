#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"
#include "ref/rounded.h"

/// y[n] = 1/P sum_p sum_c w_c d_c^2, d = a / (|a| + eps) - b / (|b| + eps), |.| over the channels.
///
/// With u_c = 2 w_c d_c:  da_c = g/P (u_c / (|a| + eps) - a_c (u . a) / (|a| (|a| + eps)^2)); 0 for a = 0.
///
/// d is a difference of rounded numbers: its magnitudes hold those of both unit vectors. An element of one is a
/// quotient by a root, and so is 1 / |a|: off by 14 roundings, where a bound has 8 and more for each magnitude.
namespace splat::ref {

inline constexpr double kByLength = (kRootRoundings + kQuotientRoundings) / 8;

struct FeatureShape {
    std::size_t n, c, p;
};

template <class Real>
struct FeaturePixel {
    Real length_a = 0, length_b = 0;
    std::vector<Real> a, d,
        size;  ///< size = kByLength (|a| / (|a| + eps) + the same of b), by element
};

template <class Real>
FeaturePixel<Real> feature_pixel(const FeatureShape& s, const std::vector<Real>& a,
                                 const std::vector<Real>& b, std::size_t n, std::size_t p) {
    const Real eps = Real(1e-10);
    FeaturePixel<Real> pixel;
    const auto at = [&](std::size_t c) { return (n * s.c + c) * s.p + p; };
    for (std::size_t c = 0; c < s.c; ++c) {
        pixel.length_a += a[at(c)] * a[at(c)];
        pixel.length_b += b[at(c)] * b[at(c)];
    }
    pixel.length_a = std::sqrt(pixel.length_a);
    pixel.length_b = std::sqrt(pixel.length_b);
    for (std::size_t c = 0; c < s.c; ++c) {
        const Real of_a = a[at(c)] / (pixel.length_a + eps);
        const Real of_b = b[at(c)] / (pixel.length_b + eps);
        pixel.a.push_back(a[at(c)]);
        pixel.d.push_back(of_a - of_b);
        pixel.size.push_back(Real(kByLength) * (std::abs(of_a) + std::abs(of_b)));
    }
    return pixel;
}

template <class Real>
Summed<Real> feature_distance_forward(const FeatureShape& s, const std::vector<Real>& a,
                                      const std::vector<Real>& b, const std::vector<Real>& w) {
    Summed<Real> y(s.n, s.c + s.p);
    for (std::size_t n = 0; n < s.n; ++n)
        for (std::size_t p = 0; p < s.p; ++p) {
            const FeaturePixel<Real> pixel = feature_pixel(s, a, b, n, p);
            for (std::size_t c = 0; c < s.c; ++c) {
                const Real d = pixel.d[c];
                y.add(n, w[c] * d * d / Real(s.p),
                      std::abs(w[c]) * (d * d + 2 * std::abs(d) * pixel.size[c]) / Real(s.p));
            }
        }
    return y;
}

template <class Real>
Summed<Real> feature_distance_backward(const FeatureShape& s, const std::vector<Real>& a,
                                       const std::vector<Real>& b, const std::vector<Real>& w,
                                       const std::vector<Real>& grad_y) {
    const Real eps = Real(1e-10);
    Summed<Real> grad(a.size(), s.c + 4);
    for (std::size_t n = 0; n < s.n; ++n)
        for (std::size_t p = 0; p < s.p; ++p) {
            const FeaturePixel<Real> pixel = feature_pixel(s, a, b, n, p);
            if (pixel.length_a == 0) continue;
            Real along = 0, along_size = 0;
            for (std::size_t c = 0; c < s.c; ++c) {
                along += 2 * w[c] * pixel.d[c] * pixel.a[c];
                along_size +=
                    2 * std::abs(w[c] * pixel.a[c]) * (std::abs(pixel.d[c]) + pixel.size[c]);
            }
            const Real length = pixel.length_a + eps;
            const Real scale = grad_y[n] / Real(s.p);
            for (std::size_t c = 0; c < s.c; ++c) {
                const Real back = 1 / (pixel.length_a * length * length);
                grad.add(
                    (n * s.c + c) * s.p + p,
                    scale * (2 * w[c] * pixel.d[c] / length - pixel.a[c] * along * back),
                    std::abs(scale) *
                        (2 * std::abs(w[c]) *
                             (Real(kByLength) * std::abs(pixel.d[c]) + pixel.size[c]) / length +
                         std::abs(pixel.a[c]) *
                             (along_size + 3 * Real(kByLength) * std::abs(along)) * back));
            }
        }
    return grad;
}

inline FeatureShape feature_shape(const OpArguments& in) {
    return {in.inputs[0].dim(0), in.inputs[0].dim(1), in.inputs[0].pixels()};
}

inline OpExample feature_example(const Dims& dims) {
    return {.inputs = {{dims}, {dims, 0, 1, true}, {{dims[1]}, 1, 0.1, true}},
            .outputs = {{dims[0], 1}}};
}

inline constexpr OpRef kFeatureDistanceRef{
    .name = "feature_distance",
    .forward = [](const OpArguments& in) -> Sums {
        return {
            feature_distance_forward(feature_shape(in), in.values(0), in.values(1), in.values(2))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {feature_distance_backward(feature_shape(in), in.values(0), in.values(1),
                                          in.values(2), grads[0]),
                {},
                {}};
    },
    .examples =
        [] {
            return std::vector{feature_example({2, 6, 5, 6})};
        },
    .sizes =
        [] {
            return std::vector{feature_example({1, 64, 128, 128}), feature_example({1, 512, 8, 8})};
        }};

}  // namespace splat::ref
