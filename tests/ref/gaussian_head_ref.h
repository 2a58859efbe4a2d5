#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/summed.h"

/// Network channels to Gaussians; the equations are those of src/ops/gaussian_head.h. Backward, per
/// pixel, with p the point in the camera's frame and [X, w] = [p, 1] M:
///
///   grad_X = grad_means / w,  grad_w = -sum grad_means X / w^2,  grad_p = M grad_[X, w]
///   grad_depth = (grad_p . ray) (zfar - znear) s (1 - s)      grad_offset = grad_p
///   grad of q / |q|: (g - u (u . g)) / |q|, g = conj(quaternion) * grad_rotations: left multiplication
///   by a unit quaternion is a rotation of R^4, whose transpose is that by the conjugate
///   coefficients: grad = T grad_rotated
///
/// sigmoid and exp may be 3 + 2|x| ulp off, which the magnitudes hold.
namespace splat::ref {

template <class Real>
struct GaussianHeadInput {
    std::size_t images = 1;
    std::size_t pixels = 1;
    std::size_t sh_degree = 1;
    bool offset = true;
    bool isotropic = false;
    bool activate = true;
    bool sh_transform = true;
    Real znear = 0;
    Real zfar = 1;
    std::vector<Real> net_out;        ///< [images,C,P]
    std::vector<Real> rays;           ///< [3,P]
    std::vector<Real> view_to_world;  ///< [images,4,4]
    std::vector<Real> quaternion;     ///< [images,4]
    std::vector<Real> focal;          ///< [images,2], or empty
    std::vector<Real> distance;       ///< [images,P], or empty

    [[nodiscard]] std::size_t channels() const { return net_out.size() / (images * pixels); }
    [[nodiscard]] std::size_t opacity_at() const { return offset ? 4 : 1; }
    [[nodiscard]] std::size_t at(std::size_t i, std::size_t c) const {
        return (i / pixels * channels() + c) * pixels + i % pixels;
    }
    [[nodiscard]] Real net(std::size_t i, std::size_t c) const { return net_out[at(i, c)]; }
    [[nodiscard]] Real matrix(std::size_t i, std::size_t row, std::size_t column) const {
        return view_to_world[i / pixels * 16 + row * 4 + column];
    }
    [[nodiscard]] Real ray(std::size_t i, std::size_t axis) const {
        const Real value = rays[axis * pixels + i % pixels];
        return focal.empty() || axis == 2 ? value : value / focal[i / pixels * 2 + axis];
    }
    /// T[row][column] = (V^T M V)[row][column].
    [[nodiscard]] Real turn(std::size_t i, std::size_t row, std::size_t column) const {
        if (!sh_transform) return row == column ? 1 : 0;
        constexpr int v[3][3] = {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}};
        Real sum = 0;
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t b = 0; b < 3; ++b)
                sum += Real(v[a][row]) * matrix(i, a, b) * Real(v[b][column]);
        return sum;
    }
};

/// Outputs, or gradients of them, in the order of the operator's ports: means, opacities, scales,
/// rotations, sh.
template <class Real>
using GaussianHeadArrays = std::array<std::vector<Real>, 5>;

template <class Real>
Real head_sigmoid(Real x) {
    return 1 / (1 + std::exp(-x));
}

/// Magnitude of sigmoid(x), relative to it.
template <class Real>
Real head_sigmoid_error(Real x) {
    return 1 + (3 + std::abs(x)) * (1 - head_sigmoid(x));
}

template <class Real>
struct HeadPoint {
    Real sigmoid = 0;
    std::array<Real, 4> world{};
    std::array<Real, 4> magnitude{};
};

template <class Real>
HeadPoint<Real> head_point(const GaussianHeadInput<Real>& in, std::size_t i) {
    HeadPoint<Real> point;
    point.sigmoid = head_sigmoid(in.net(i, 0));
    const Real span = in.zfar - in.znear;
    const Real plane = in.distance.empty() ? Real(0) : in.distance[i];
    const Real depth = point.sigmoid * span + in.znear + plane;
    const Real depth_magnitude = std::abs(point.sigmoid * span) * head_sigmoid_error(in.net(i, 0)) +
                                 std::abs(in.znear) + std::abs(plane);
    for (std::size_t j = 0; j < 4; ++j) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Real offset = in.offset ? in.net(i, 1 + axis) : Real(0);
            point.world[j] += (in.ray(i, axis) * depth + offset) * in.matrix(i, axis, j);
            point.magnitude[j] += (std::abs(in.ray(i, axis)) * depth_magnitude + std::abs(offset)) *
                                  std::abs(in.matrix(i, axis, j));
        }
        point.world[j] += in.matrix(i, 3, j);
        point.magnitude[j] += std::abs(in.matrix(i, 3, j));
    }
    point.world[3] += Real(1e-10);
    return point;
}

/// a * b, or conj(a) * b.
template <class Real>
std::array<Real, 4> head_product(std::array<Real, 4> a, const std::array<Real, 4>& b,
                                 bool conjugate) {
    if (conjugate)
        for (std::size_t k = 1; k < 4; ++k) a[k] = -a[k];
    return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

template <class Real>
std::array<Real, 4> head_quad(const std::vector<Real>& values, std::size_t at) {
    return {values[at], values[at + 1], values[at + 2], values[at + 3]};
}

template <class Real>
std::array<Real, 4> head_rotation(const GaussianHeadInput<Real>& in, std::size_t i, Real* norm) {
    std::array<Real, 4> q;
    Real square = 0;
    for (std::size_t k = 0; k < 4; ++k) {
        q[k] = in.net(i, in.opacity_at() + 4 + k);
        square += q[k] * q[k];
    }
    *norm = std::max(std::sqrt(square), Real(1e-12));
    for (Real& value : q) value /= *norm;
    return q;
}

template <class Real>
std::vector<Summed<Real>> gaussian_head_forward(const GaussianHeadInput<Real>& in) {
    const std::size_t count = in.images * in.pixels;
    const std::size_t coefficients = in.sh_degree == 0 ? 1 : 4;
    std::vector<Summed<Real>> out = {Summed<Real>(3 * count, 6), Summed<Real>(count, 1),
                                     Summed<Real>(3 * count, 1), Summed<Real>(4 * count, 6),
                                     Summed<Real>(3 * coefficients * count, 3)};
    const std::size_t first = in.opacity_at();
    for (std::size_t i = 0; i < count; ++i) {
        const HeadPoint<Real> point = head_point(in, i);
        const auto& [s, world, magnitude] = point;
        for (std::size_t k = 0; k < 3; ++k)
            out[0].add(3 * i + k, world[k] / world[3],
                       (magnitude[k] + std::abs(world[k] / world[3]) * (magnitude[3] + 1)) /
                           std::abs(world[3]));
        const Real logit = in.net(i, first);
        const Real opacity = in.activate ? head_sigmoid(logit) : logit;
        out[1].add(i, opacity,
                   std::abs(opacity) * (in.activate ? head_sigmoid_error(logit) : Real(1)));
        for (std::size_t k = 0; k < 3; ++k) {
            const Real raw = in.net(i, first + 1 + (in.isotropic ? 0 : k));
            const Real scale = in.activate ? std::exp(raw) : raw;
            out[2].add(3 * i + k, scale, std::abs(scale) * (3 + std::abs(raw)));
        }
        Real norm = 0;
        const auto turned = head_product(head_quad(in.quaternion, i / in.pixels * 4),
                                         head_rotation(in, i, &norm), false);
        for (std::size_t k = 0; k < 4; ++k) out[3].add(4 * i + k, turned[k], Real(4));
        for (std::size_t rgb = 0; rgb < 3; ++rgb) {
            const std::size_t to = 3 * coefficients * i + rgb;
            out[4].add(to, in.net(i, first + 8 + rgb));
            if (in.sh_degree == 0) continue;
            for (std::size_t a = 0; a < 3; ++a)
                for (std::size_t b = 0; b < 3; ++b)
                    out[4].add(to + 3 * (b + 1),
                               in.net(i, first + 11 + 3 * a + rgb) * in.turn(i, a, b));
        }
    }
    return out;
}

template <class Real>
Summed<Real> gaussian_head_backward(const GaussianHeadInput<Real>& in,
                                    const GaussianHeadArrays<Real>& grads) {
    const std::size_t coefficients = in.sh_degree == 0 ? 1 : 4;
    Summed<Real> grad(in.net_out.size(), 8);
    const std::size_t first = in.opacity_at();
    for (std::size_t i = 0; i < in.images * in.pixels; ++i) {
        const auto put = [&](std::size_t c, Real value, Real magnitude) {
            grad.add(in.at(i, c), value, magnitude);
        };
        const auto [s, world, unused] = head_point(in, i);
        const Real slope = s * (1 - s) * (in.zfar - in.znear);
        std::array<Real, 4> grad_world{};
        Real size_world = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            grad_world[k] = grads[0][3 * i + k] / world[3];
            grad_world[3] -= grad_world[k] * world[k] / world[3];
            size_world += std::abs(grad_world[k]) * (1 + std::abs(world[k] / world[3]));
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Real grad_p = 0;
            Real magnitude = 0;
            for (std::size_t j = 0; j < 4; ++j) {
                grad_p += in.matrix(i, axis, j) * grad_world[j];
                magnitude += 3 * std::abs(in.matrix(i, axis, j)) * size_world;
            }
            put(0, grad_p * in.ray(i, axis) * slope,
                magnitude * std::abs(in.ray(i, axis) * slope) * 2 *
                        head_sigmoid_error(in.net(i, 0)) +
                    std::abs(grad_p * in.ray(i, axis) * s * s * (in.zfar - in.znear)));
            if (in.offset) put(1 + axis, grad_p, magnitude);
        }
        const Real o = head_sigmoid(in.net(i, first));
        put(first, grads[1][i] * (in.activate ? o * (1 - o) : Real(1)),
            std::abs(grads[1][i]) *
                (in.activate ? 2 * o * (1 - o) * head_sigmoid_error(in.net(i, first)) + o * o
                             : Real(1)));
        for (std::size_t k = 0; k < 3; ++k) {
            const Real raw = in.net(i, first + 1 + (in.isotropic ? 0 : k));
            const Real value = grads[2][3 * i + k] * (in.activate ? std::exp(raw) : Real(1));
            put(first + 1 + (in.isotropic ? 0 : k), value, std::abs(value) * (3 + std::abs(raw)));
        }
        Real norm = 0;
        const auto unit = head_rotation(in, i, &norm);
        const auto g = head_product(head_quad(in.quaternion, i / in.pixels * 4),
                                    head_quad(grads[3], 4 * i), true);
        Real along = 0;
        Real size = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            along += unit[k] * g[k];
            size += std::abs(g[k]);
        }
        for (std::size_t k = 0; k < 4; ++k)
            put(first + 4 + k, (g[k] - (norm > Real(1e-12) ? unit[k] * along : Real(0))) / norm,
                4 * size / norm);
        for (std::size_t rgb = 0; rgb < 3; ++rgb) {
            const std::size_t from = 3 * coefficients * i + rgb;
            put(first + 8 + rgb, grads[4][from], std::abs(grads[4][from]));
            if (in.sh_degree == 0) continue;
            for (std::size_t a = 0; a < 3; ++a)
                for (std::size_t b = 0; b < 3; ++b) {
                    const Real term = in.turn(i, a, b) * grads[4][from + 3 * (b + 1)];
                    put(first + 11 + 3 * a + rgb, term, std::abs(term));
                }
        }
    }
    return grad;
}

}  // namespace splat::ref
