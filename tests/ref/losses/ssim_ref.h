#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"
#include "ref/rounded.h"

/// Structural similarity, forward and backward, with the window's 121 taps in one sum; Number is double,
/// or Rounded for the magnitudes too.
///
/// With the moments m at a pixel q, m_f(q) = sum_p w(p - q) f(p) for f = a, b, a^2, b^2, a b:
///
///   A1 = 2 ma mb + C1      A2 = 2 (mab - ma mb) + C2
///   B1 = ma^2 + mb^2 + C1  B2 = (maa - ma^2) + (mbb - mb^2) + C2      S = A1 A2 / (B1 B2)
///
/// The loss is the mean of S. Its slopes, taking ma, maa and mab as free:
///
///   by maa: -S / B2        by mab: 2 A1 / (B1 B2)
///   by ma:  (2 mb A2 - 2 mb A1) / (B1 B2) - S 2 ma / B1 + S 2 ma / B2
///
/// and as the window is even, a(p) gets  sum_q w(p - q) (D_a + 2 a(p) D_aa + b(p) D_ab)(q) / elements.
namespace splat::ref {

struct SsimInput {
    std::size_t planes = 1;  ///< images * channels
    std::size_t height = 1;
    std::size_t width = 1;
    std::vector<double> a;  ///< [planes,height,width]
    std::vector<double> b;
};

/// Number of sums through which a number goes at most in either direction: along rows, along
/// columns, twice.
inline constexpr std::size_t kSsimTerms = 44;

inline double ssim_window(std::size_t y, std::size_t x) {
    const auto line = [](double at) { return std::exp(-at * at / (2 * 1.5 * 1.5)); };
    double sum = 0;
    for (int i = -5; i <= 5; ++i) sum += line(i);
    return line(static_cast<double>(y) - 5) * line(static_cast<double>(x) - 5) / (sum * sum);
}

/// Calls use(pixel q, weight) for the pixels under the window around pixel p.
template <class Use>
void ssim_taps(const SsimInput& in, std::size_t p, const Use& use) {
    static const std::array<double, 121> window = [] {
        std::array<double, 121> weights{};
        for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = ssim_window(i / 11, i % 11);
        return weights;
    }();
    const std::size_t x = p % in.width;
    const std::size_t y = p / in.width % in.height;
    for (std::size_t i = 0; i < 11; ++i)
        for (std::size_t j = 0; j < 11; ++j)
            if (y + i >= 5 && y + i < in.height + 5 && x + j >= 5 && x + j < in.width + 5)
                use(p + i * in.width + j - 5 * in.width - 5, window[11 * i + j]);
}

/// S at a pixel, and its slopes by ma, maa and mab.
template <class Number>
std::array<Number, 4> ssim_at(const SsimInput& in, std::size_t p) {
    std::array<Number, 5> m;
    m.fill(Number(0));
    ssim_taps(in, p, [&](std::size_t q, double weight) {
        const Number a(in.a[q]);
        const Number b(in.b[q]);
        const Number w(weight);
        const std::array<Number, 5> terms = {w * a, w * b, w * a * a, w * b * b, w * a * b};
        for (std::size_t k = 0; k < 5; ++k) m[k] = m[k] + terms[k];
    });
    const Number two(2);
    const Number A1 = two * m[0] * m[1] + Number(1e-4);
    const Number A2 = two * (m[4] - m[0] * m[1]) + Number(9e-4);
    const Number B1 = m[0] * m[0] + m[1] * m[1] + Number(1e-4);
    const Number B2 = (m[2] - m[0] * m[0]) + (m[3] - m[1] * m[1]) + Number(9e-4);
    const Number S = A1 * A2 / (B1 * B2);
    return {S, two * m[1] * (A2 - A1) / (B1 * B2) - S * two * m[0] / B1 + S * two * m[0] / B2,
            -S / B2, two * A1 / (B1 * B2)};
}

template <class Number>
std::vector<Number> ssim_forward(const SsimInput& in) {
    Number sum(0);
    for (std::size_t p = 0; p < in.a.size(); ++p) sum = sum + ssim_at<Number>(in, p)[0];
    return {sum / Number(static_cast<double>(in.a.size()))};
}

template <class Number>
std::vector<Number> ssim_backward(const SsimInput& in, double grad_loss) {
    std::vector<std::array<Number, 4>> slopes(in.a.size());
    for (std::size_t p = 0; p < in.a.size(); ++p) slopes[p] = ssim_at<Number>(in, p);
    std::vector<Number> grad_a(in.a.size(), Number(0));
    for (std::size_t p = 0; p < in.a.size(); ++p) {
        const Number twice_a(2 * in.a[p]);
        const Number b(in.b[p]);
        ssim_taps(in, p, [&](std::size_t q, double weight) {
            const auto& [similarity, by_a, by_aa, by_ab] = slopes[q];
            grad_a[p] = grad_a[p] + Number(weight) * (by_a + twice_a * by_aa + b * by_ab);
        });
        grad_a[p] = grad_a[p] * Number(grad_loss / static_cast<double>(in.a.size()));
    }
    return grad_a;
}

inline SsimInput ssim_input(const OpArguments& in) {
    const OpTensor& a = in.inputs[0];
    return {a.dim(0) * a.dim(1), a.dim(2), a.dim(3), a.values, in.values(1)};
}

inline constexpr OpRef kSsimRef{
    .name = "ssim",
    .forward = [](const OpArguments& in) -> Sums {
        return {summed(ssim_forward<Rounded>(ssim_input(in)), in.values(0).size())};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {summed(ssim_backward<Rounded>(ssim_input(in), grads[0][0]), kSsimTerms), {}};
    },
    .examples = image_loss_examples,
    .sizes = image_loss_sizes};

}  // namespace splat::ref
