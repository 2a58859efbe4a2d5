#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Group normalisation with an optional fused SiLU, forward and backward, in plain loops.
///
/// Forward, with M = C/G * pixels elements per group (Wu & He 2018, arXiv:1803.08494, eq. 1-3):
///
///   mean = sum x / M      var = sum (x - mean)^2 / M      rstd = 1 / sqrt(var + eps)
///   xhat = (x - mean) * rstd      t = gamma * xhat + beta
///   y = silu ? t * s(t) : t       s(t) = 1 / (1 + exp(-t))
///
/// Backward. Let e = grad_y * dy/dt, with dy/dt = s(t) * (1 + t * (1 - s(t))) or 1; then per
/// channel
///
///   grad_beta = sum e      grad_gamma = sum e * xhat      (over batch and pixels)
///
/// and h = e * gamma is the gradient with respect to xhat. Within a group
///
///   d xhat_j / d x_i = rstd * (delta_ij - 1/M - xhat_i * xhat_j / M),
///
/// because d mean / d x_i = 1/M and d rstd / d x_i = -rstd^2 * xhat_i / M (the term through the
/// mean vanishes as sum (x - mean) = 0). So
///
///   grad_x_i = rstd * (h_i - (sum_j h_j) / M - xhat_i * (sum_j h_j * xhat_j) / M).
///
/// Magnitudes. x - mean is a sum of 1 + M terms with S = |x| + mean |x|; this X = rstd * S takes
/// the place of |xhat| wherever the rounding of xhat counts. s(t) and its derivatives are smooth:
/// |d2y/dt2| <= 1/2 carries the error of t into e.
namespace splat::ref {

struct GroupNormShape {
    std::size_t N = 1;
    std::size_t C = 1;
    std::size_t pixels = 1;  ///< H * W
    std::size_t G = 1;       ///< divides C

    [[nodiscard]] std::size_t elements() const { return N * C * pixels; }
    [[nodiscard]] std::size_t group_elements() const { return C / G * pixels; }
    [[nodiscard]] std::size_t channel(std::size_t i) const { return i / pixels % C; }
    /// Index into mean and rstd of element i. Groups are contiguous in NCHW.
    [[nodiscard]] std::size_t group(std::size_t i) const { return i / group_elements(); }
};

template <class Real>
struct GroupNormInput {
    GroupNormShape shape;
    Real eps = Real(1e-5);
    bool silu = false;
    std::vector<Real> x;      ///< [N,C,H,W]
    std::vector<Real> gamma;  ///< [C]
    std::vector<Real> beta;   ///< [C]
};

template <class Real>
struct GroupNormForward {
    Summed<Real> y;     ///< [N,C,H,W]
    Summed<Real> mean;  ///< [N,G]
    Summed<Real> rstd;  ///< [N,G]
};

template <class Real>
struct GroupNormBackward {
    Summed<Real> grad_x;      ///< [N,C,H,W]
    Summed<Real> grad_gamma;  ///< [C]
    Summed<Real> grad_beta;   ///< [C]
};

template <class Real>
Real sigmoid(Real t) {
    return Real(1) / (Real(1) + std::exp(-t));
}

template <class Real>
void group_norm_statistics(const GroupNormInput<Real>& in, GroupNormForward<Real>& out) {
    const GroupNormShape& shape = in.shape;
    const std::size_t M = shape.group_elements();
    const std::size_t groups = shape.N * shape.G;
    out.mean = Summed<Real>(groups, M);
    out.rstd = Summed<Real>(groups, M);
    for (std::size_t i = 0; i < shape.elements(); ++i)
        out.mean.add(shape.group(i), in.x[i] / static_cast<Real>(M));
    std::vector<Real> var(groups, Real(0));
    for (std::size_t i = 0; i < shape.elements(); ++i) {
        const Real deviation = in.x[i] - out.mean.value[shape.group(i)];
        var[shape.group(i)] += deviation * deviation / static_cast<Real>(M);
    }
    for (std::size_t g = 0; g < groups; ++g) {
        const Real rstd = Real(1) / std::sqrt(var[g] + in.eps);
        out.rstd.add(g, rstd);
    }
}

/// What both directions need of one element.
template <class Real>
struct GroupNormElement {
    Real xhat;
    Real xhat_magnitude;
    Real t;
    Real t_magnitude;
    Real slope;            ///< dy/dt
    Real slope_magnitude;  ///< |dy/dt| and the effect of the rounding of t on it
};

template <class Real>
GroupNormElement<Real> group_norm_element(const GroupNormInput<Real>& in,
                                          const GroupNormForward<Real>& statistics, std::size_t i) {
    const std::size_t g = in.shape.group(i);
    const std::size_t c = in.shape.channel(i);
    const Real rstd = statistics.rstd.value[g];
    GroupNormElement<Real> e{};
    e.xhat = (in.x[i] - statistics.mean.value[g]) * rstd;
    e.xhat_magnitude = (std::abs(in.x[i]) + statistics.mean.magnitude[g]) * rstd;
    e.t = in.gamma[c] * e.xhat + in.beta[c];
    e.t_magnitude = std::abs(in.gamma[c]) * e.xhat_magnitude + std::abs(in.beta[c]);
    e.slope = Real(1);
    e.slope_magnitude = Real(1);
    if (in.silu) {
        const Real s = sigmoid(e.t);
        e.slope = s * (Real(1) + e.t * (Real(1) - s));
        e.slope_magnitude = s * (Real(1) + std::abs(e.t) * (Real(1) - s)) + e.t_magnitude / Real(2);
    }
    return e;
}

template <class Real>
GroupNormForward<Real> group_norm_forward(const GroupNormInput<Real>& in) {
    GroupNormForward<Real> out;
    group_norm_statistics(in, out);
    out.y = Summed<Real>(in.shape.elements(), in.shape.group_elements() + 2);
    for (std::size_t i = 0; i < in.shape.elements(); ++i) {
        const GroupNormElement<Real> e = group_norm_element(in, out, i);
        if (!in.silu) {
            out.y.add(i, e.t, e.t_magnitude);
            continue;
        }
        // exp and the division are a few units off on their own, relative to y.
        const Real y = e.t * sigmoid(e.t);
        out.y.add(i, y, std::abs(e.slope) * e.t_magnitude + Real(2) * std::abs(y));
    }
    return out;
}

template <class Real>
GroupNormBackward<Real> group_norm_backward(const GroupNormInput<Real>& in,
                                            const std::vector<Real>& grad_y) {
    const GroupNormShape& shape = in.shape;
    const auto M = static_cast<Real>(shape.group_elements());
    GroupNormForward<Real> statistics;
    group_norm_statistics(in, statistics);

    GroupNormBackward<Real> out;
    out.grad_x = Summed<Real>(shape.elements(), shape.group_elements() + 3);
    const std::size_t parameter_terms = shape.N * shape.pixels + shape.group_elements();
    out.grad_gamma = Summed<Real>(shape.C, parameter_terms);
    out.grad_beta = Summed<Real>(shape.C, parameter_terms);
    Summed<Real> sum_h(shape.N * shape.G, 0);       // per group: sum of h
    Summed<Real> sum_h_xhat(shape.N * shape.G, 0);  // per group: sum of h * xhat
    for (std::size_t i = 0; i < shape.elements(); ++i) {
        const GroupNormElement<Real> e = group_norm_element(in, statistics, i);
        const std::size_t c = shape.channel(i);
        const std::size_t g = shape.group(i);
        const Real grad_t = grad_y[i] * e.slope;
        const Real grad_t_magnitude = std::abs(grad_y[i]) * e.slope_magnitude;
        const Real product_magnitude =
            grad_t_magnitude * std::abs(e.xhat) + std::abs(grad_t) * e.xhat_magnitude;
        out.grad_beta.add(c, grad_t, grad_t_magnitude);
        out.grad_gamma.add(c, grad_t * e.xhat, product_magnitude);
        sum_h.add(g, grad_t * in.gamma[c], grad_t_magnitude * std::abs(in.gamma[c]));
        sum_h_xhat.add(g, grad_t * in.gamma[c] * e.xhat, product_magnitude * std::abs(in.gamma[c]));
    }
    for (std::size_t i = 0; i < shape.elements(); ++i) {
        const GroupNormElement<Real> e = group_norm_element(in, statistics, i);
        const std::size_t g = shape.group(i);
        const Real rstd = statistics.rstd.value[g];
        const Real gamma = in.gamma[shape.channel(i)];
        const Real slope_h = std::abs(grad_y[i]) * e.slope_magnitude * std::abs(gamma);
        out.grad_x.add(i, rstd * grad_y[i] * e.slope * gamma, rstd * slope_h);
        out.grad_x.add(i, -rstd * sum_h.value[g] / M, rstd * sum_h.magnitude[g] / M);
        out.grad_x.add(i, -rstd * e.xhat * sum_h_xhat.value[g] / M,
                       rstd / M *
                           (std::abs(e.xhat) * sum_h_xhat.magnitude[g] +
                            e.xhat_magnitude * std::abs(sum_h_xhat.value[g])));
    }
    return out;
}

inline GroupNormInput<double> group_norm_input(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {{x.dim(0), x.dim(1), x.pixels(), in.count("groups")},
            in.single("eps"),
            in.flag("silu"),
            x.values,
            in.values(1),
            in.values(2)};
}

inline OpExample group_norm_example(const Dims& x, std::size_t groups, bool silu) {
    const std::string count = std::to_string(groups);
    return {.inputs = {{x, 0.5, 1}, {{x[1]}, 1, 0.25}, {{x[1]}, 0, 0.25}},
            .outputs = {x},
            .attributes = "{\"groups\": " + count +
                          ", \"eps\": 1e-6, \"silu\": " + (silu ? "true}" : "false}"),
            .title = text_of(x) + " G=" + count + (silu ? " silu" : "")};
}

inline constexpr OpRef kGroupNormRef{
    .name = "group_norm",
    .forward = [](const OpArguments& in) -> Sums {
        return {group_norm_forward(group_norm_input(in)).y};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        const auto grad = group_norm_backward(group_norm_input(in), grads[0]);
        return {grad.grad_x, grad.grad_gamma, grad.grad_beta};
    },
    .examples =
        [] {  // whole quads per group, and not
            return std::vector{group_norm_example({2, 8, 5, 7}, 2, true),
                               group_norm_example({2, 6, 5, 7}, 2, true)};
        },
    .sizes =
        [] {
            std::vector<OpExample> all;
            for (const bool silu : {false, true})
                for (const Dims& x : {Dims{1, 128, 128, 128}, Dims{1, 256, 32, 32},
                                      Dims{8, 256, 16, 16}, Dims{1, 512, 16, 16}})
                    all.push_back(group_norm_example(x, 32, silu));
            return all;
        }};

}  // namespace splat::ref
