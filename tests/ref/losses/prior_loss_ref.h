#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "ref/rounded.h"

/// The losses of a view against maps of depth and normals, forward and backward; Number is double, or Rounded for the
/// magnitudes too. With E = D / A, y = A / D, P = E (u, v, 1) and (u, v, 1) the ray of a pixel,
///
///   depth  = sum |y - max(s p + t, 0)| / (mean N_depth)
///   normal = sum (1 - n m) / N_normal,  n = b x a / |b x a|,  a = P(right) - P(left),  b = P(below) - P(above)
///
/// over the pixels with A > 1/2 that have a depth p; and over those whose four neighbours have A > 1/2 that have a
/// normal m, which are not at the border. The alignment s, t and the mean are constant.
namespace splat::ref {

struct PriorLossInput {
    std::size_t height = 1, width = 1;
    double fx = 1, fy = 1, cx = 0, cy = 0;
    double depth_weight = 1, normal_weight = 1;
    double scale = 1, shift = 0, mean = 1;
    std::vector<double> depth, alpha;            ///< [height,width] D and A
    std::vector<double> nearness;                ///< [height,width] p; NaN: none
    std::vector<std::array<double, 3>> normals;  ///< [height,width] m, of length 1 or 0: none
    [[nodiscard]] std::size_t pixels() const { return height * width; }
    [[nodiscard]] bool drawn(std::size_t i) const { return alpha[i] > 0.5; }
    [[nodiscard]] std::size_t depths() const {
        return static_cast<std::size_t>(std::count_if(nearness.begin(), nearness.end(),
                                                      [](double p) { return !std::isnan(p); }));
    }
    [[nodiscard]] static bool has(const std::array<double, 3>& normal) {
        return normal != std::array<double, 3>{};
    }
    [[nodiscard]] std::size_t normal_count() const {
        return static_cast<std::size_t>(std::count_if(normals.begin(), normals.end(), has));
    }
    [[nodiscard]] std::array<double, 3> ray(std::size_t i) const {
        return {(static_cast<double>(i % width) + 0.5 - cx) / fx,
                (static_cast<double>(i / width) + 0.5 - cy) / fy, 1};
    }
};

template <class Number>
using Triple = std::array<Number, 3>;

template <class Number>
Triple<Number> cross_of(const Triple<Number>& a, const Triple<Number>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class Number>
Number dot_of(const Triple<Number>& a, const Triple<Number>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Number>
struct PriorLossOutput {
    Number depth{0}, normal{0};                  ///< without their weights
    std::vector<Number> grad_depth, grad_alpha;  ///< gradient of the weighted sum
};

template <class Number>
void prior_depth(const PriorLossInput& in, PriorLossOutput<Number>& out) {
    const Number count(static_cast<double>(std::max<std::size_t>(in.depths(), 1)) * in.mean);
    for (std::size_t i = 0; i < in.pixels(); ++i) {
        if (std::isnan(in.nearness[i]) || !in.drawn(i)) continue;
        const Number d(in.depth[i]), a(in.alpha[i]);
        Number target = Number(in.scale) * Number(in.nearness[i]) + Number(in.shift);
        if (number_of(target) < 0) target = Number(0);
        const Number difference = a / d - target;
        const Number sign(number_of(difference) < 0 ? -1 : number_of(difference) > 0 ? 1 : 0);
        out.depth = out.depth + sign * difference / count;
        const Number by_y = Number(in.depth_weight) * sign / count;
        out.grad_depth[i] = out.grad_depth[i] - by_y * a / (d * d);
        out.grad_alpha[i] = out.grad_alpha[i] + by_y / d;
    }
}

template <class Number>
void prior_normal(const PriorLossInput& in, PriorLossOutput<Number>& out) {
    const Number count(static_cast<double>(std::max<std::size_t>(in.normal_count(), 1)));
    const auto numbers = [](const std::array<double, 3>& v) {
        return Triple<Number>{Number(v[0]), Number(v[1]), Number(v[2])};
    };
    for (std::size_t i = 0; i < in.pixels(); ++i) {
        if (!PriorLossInput::has(in.normals[i])) continue;
        const std::array<std::size_t, 4> at{i - 1, i + 1, i - in.width, i + in.width};
        if (!std::all_of(at.begin(), at.end(), [&](std::size_t k) { return in.drawn(k); }))
            continue;
        std::array<Triple<Number>, 4> place;
        for (std::size_t k = 0; k < 4; ++k) {
            place[k] = numbers(in.ray(at[k]));
            for (Number& x : place[k]) x = x * Number(in.depth[at[k]]) / Number(in.alpha[at[k]]);
        }
        Triple<Number> a, b;
        for (std::size_t c = 0; c < 3; ++c) {
            a[c] = place[1][c] - place[0][c];
            b[c] = place[3][c] - place[2][c];
        }
        Triple<Number> n = cross_of(b, a);
        using std::sqrt;
        const Number size = sqrt(dot_of(n, n));
        for (Number& x : n) x = x / size;
        const Triple<Number> m = numbers(in.normals[i]);
        const Number agrees = dot_of(n, m);
        out.normal = out.normal + (Number(1) - agrees) / count;
        Triple<Number> g;
        for (std::size_t c = 0; c < 3; ++c)
            g[c] = (n[c] * agrees - m[c]) / size * Number(in.normal_weight) / count;
        const Triple<Number> by_a = cross_of(g, b), by_b = cross_of(a, g);
        for (std::size_t k = 0; k < 4; ++k) {
            const Number slope = dot_of(k < 2 ? by_a : by_b, numbers(in.ray(at[k])));
            const Number by_e = k % 2 == 0 ? -slope : slope;
            const Number d(in.depth[at[k]]), alpha(in.alpha[at[k]]);
            out.grad_depth[at[k]] = out.grad_depth[at[k]] + by_e / alpha;
            out.grad_alpha[at[k]] = out.grad_alpha[at[k]] - by_e * d / (alpha * alpha);
        }
    }
}

template <class Number>
PriorLossOutput<Number> prior_loss(const PriorLossInput& in) {
    PriorLossOutput<Number> out;
    out.grad_depth.assign(in.pixels(), Number(0));
    out.grad_alpha.assign(in.pixels(), Number(0));
    prior_depth(in, out);
    prior_normal(in, out);
    return out;
}

/// Scale and shift of the least squares of s p + t to y, and the mean of y.
inline std::array<double, 3> prior_alignment(const PriorLossInput& in) {
    double n = 0, p = 0, pp = 0, y = 0, py = 0;
    for (std::size_t i = 0; i < in.pixels(); ++i) {
        if (std::isnan(in.nearness[i]) || !in.drawn(i)) continue;
        const double at = in.nearness[i], inverse = in.alpha[i] / in.depth[i];
        n += 1;
        p += at;
        pp += at * at;
        y += inverse;
        py += at * inverse;
    }
    const double scale = (n * py - p * y) / (n * pp - p * p);
    return {scale, (y - scale * p) / n, y / n};
}

}  // namespace splat::ref
