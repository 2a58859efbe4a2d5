#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/rounded.h"

/// Turns network output into one Gaussian per pixel, in plain loops; Number is double, or Rounded for the
/// magnitudes too.
///
/// Forward, per pixel, with M the camera's row-vector matrix and a its quaternion:
///
///   d = sigmoid(c0) (zfar - znear) + znear + origin      p = ray d + offset
///   r = [p, 1] M      mean = r.xyz / (r.w + 1e-10)
///   opacity = sigmoid, scale = exp (or both unchanged)
///   rotation = a * q / max(|q|, 1e-12)
///   sh_0 = dc      sh_t = sum_s c_s T[s][t],  T = V^T M3 V,  V = [[0,0,-1],[-1,0,0],[0,1,0]]
///
/// Backward, G the gradient of each result, w = r.w + 1e-10:
///
///   by r: (G_mean, -G_mean . mean) / w, as d mean / d w = -mean / w      by p_i = M_i . (by r)
///   by offset: by p      by c0: (ray . by p) (zfar - znear) s (1 - s)
///   by the unit quaternion u: conj(a) * G (the transpose of the product with a)
///   by q: (by u - u (u . by u)) / |q| where |q| > 1e-12, as du/dq = (1 - u u^T) / |q|, else by u / 1e-12
///   by c_s: sum_t G_t T[s][t]
namespace splat::ref {

struct GaussianHeadShape {
    std::size_t images = 1;
    std::size_t pixels = 1;
    bool offset = true;
    std::size_t degree = 1;
    bool isotropic = false;
    bool activate = true;
    double znear = 0.8;
    double zfar = 1.8;

    [[nodiscard]] std::size_t gaussians() const { return images * pixels; }
    [[nodiscard]] std::size_t opacity() const { return offset ? 4 : 1; }
    [[nodiscard]] std::size_t channels() const { return opacity() + 11 + 9 * degree; }
    [[nodiscard]] std::size_t coefficients() const { return 1 + 3 * degree; }
};

struct GaussianHeadInput {
    GaussianHeadShape shape;
    std::vector<double> net_out;        ///< [images,channels,pixels]
    std::vector<double> rays;           ///< [3,pixels]
    std::vector<double> view_to_world;  ///< [images,4,4]
    std::vector<double> quaternion;     ///< [images,4]
    std::vector<double> focal;          ///< [images,2] or empty
    std::vector<double> origin;         ///< [images] or empty
};

/// Results or gradients: means, opacities, scales, rotations, sh, in the order of the operator's ports.
template <class Number>
using GaussianHeadOutputs = std::array<std::vector<Number>, 5>;

/// One pixel's inputs and the values that both directions need.
template <class Number>
class GaussianHeadPixel {
  public:
    using Four = std::array<Number, 4>;

    GaussianHeadPixel(const GaussianHeadInput& input, std::size_t image, std::size_t pixel)
        : in_(input), image_(image), pixel_(pixel) {
        for (std::size_t i = 0; i < 3; ++i) {
            ray[i] = in_.rays[i * in_.shape.pixels + pixel];
            if (i < 2 && !in_.focal.empty()) ray[i] = ray[i] / Number(in_.focal[2 * image + i]);
        }
        s = sigmoid(channel(0));
        Number depth = s * Number(in_.shape.zfar - in_.shape.znear) + Number(in_.shape.znear);
        if (!in_.origin.empty()) depth = depth + Number(in_.origin[image]);
        for (std::size_t j = 0; j < 4; ++j) world[j] = matrix(3, j);
        for (std::size_t i = 0; i < 3; ++i) {
            Number point = ray[i] * depth;
            if (in_.shape.offset) point = point + channel(1 + i);
            for (std::size_t j = 0; j < 4; ++j) world[j] = world[j] + point * matrix(i, j);
        }
        world[3] = world[3] + Number(1e-10);
        const std::size_t first = in_.shape.opacity() + 4;
        Number square(0);
        for (std::size_t i = 0; i < 4; ++i) {
            q[i] = channel(first + i);
            square = square + q[i] * q[i];
        }
        using std::sqrt;
        norm = sqrt(square);
        for (std::size_t i = 0; i < 4; ++i)
            unit[i] = q[i] / (number_of(norm) > 1e-12 ? norm : Number(1e-12));
        for (std::size_t i = 0; i < 4; ++i) camera[i] = in_.quaternion[4 * image + i];
    }

    static Number sigmoid(const Number& x) {
        using std::exp;
        return Number(1) / (Number(1) + exp(-x));
    }

    [[nodiscard]] Number channel(std::size_t c) const {
        return in_.net_out[(image_ * in_.shape.channels() + c) * in_.shape.pixels + pixel_];
    }
    [[nodiscard]] Number matrix(std::size_t i, std::size_t j) const {
        return in_.view_to_world[16 * image_ + 4 * i + j];
    }
    [[nodiscard]] Number turn(std::size_t from, std::size_t to) const {
        constexpr double V[3][3] = {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}};
        Number sum(0);
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j)
                sum = sum + Number(V[i][from] * V[j][to] * number_of(matrix(i, j)));
        return sum;
    }
    /// Scale channel that scale i comes from.
    [[nodiscard]] std::size_t scale_channel(std::size_t i) const {
        return in_.shape.opacity() + 1 + (in_.shape.isotropic ? 0 : i);
    }

    static Four product(const Four& a, const Four& b) {
        return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
    }

    std::array<Number, 3> ray;
    Number s;    ///< sigmoid of the depth channel
    Four world;  ///< r, with 1e-10 added to w
    Four q;
    Number norm;
    Four unit;
    Four camera;

  private:
    const GaussianHeadInput& in_;
    std::size_t image_;
    std::size_t pixel_;
};

template <class Number>
GaussianHeadOutputs<Number> gaussian_head_forward(const GaussianHeadInput& in) {
    using std::exp;
    const GaussianHeadShape& shape = in.shape;
    GaussianHeadOutputs<Number> out;
    for (std::size_t g = 0; g < shape.gaussians(); ++g) {
        const GaussianHeadPixel<Number> at(in, g / shape.pixels, g % shape.pixels);
        for (std::size_t i = 0; i < 3; ++i) {
            out[0].push_back(at.world[i] / at.world[3]);
            const Number scale = at.channel(at.scale_channel(i));
            out[2].push_back(shape.activate ? exp(scale) : scale);
        }
        const Number opacity = at.channel(shape.opacity());
        out[1].push_back(shape.activate ? at.sigmoid(opacity) : opacity);
        for (const Number& value : at.product(at.camera, at.unit)) out[3].push_back(value);
        const std::size_t dc = shape.opacity() + 8;
        for (std::size_t rgb = 0; rgb < 3; ++rgb) out[4].push_back(at.channel(dc + rgb));
        for (std::size_t t = 0; t + 1 < shape.coefficients(); ++t)
            for (std::size_t rgb = 0; rgb < 3; ++rgb) {
                Number sum(0);
                for (std::size_t s = 0; s < 3; ++s)
                    sum = sum + at.channel(dc + 3 + 3 * s + rgb) * at.turn(s, t);
                out[4].push_back(sum);
            }
    }
    return out;
}

/// Gradient by the channels of one pixel.
template <class Number>
std::vector<Number> gaussian_head_backward_pixel(const GaussianHeadShape& shape,
                                                 const GaussianHeadPixel<Number>& at,
                                                 const GaussianHeadOutputs<double>& grads,
                                                 std::size_t g) {
    using std::exp;
    using Four = typename GaussianHeadPixel<Number>::Four;
    std::vector<Number> grad(shape.channels(), Number(0));
    Four by_world;
    by_world[3] = Number(0);
    for (std::size_t i = 0; i < 3; ++i) {
        by_world[i] = Number(grads[0][3 * g + i]) / at.world[3];
        by_world[3] = by_world[3] - by_world[i] * (at.world[i] / at.world[3]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
        Number by_point(0);
        for (std::size_t j = 0; j < 4; ++j) by_point = by_point + at.matrix(i, j) * by_world[j];
        if (shape.offset) grad[1 + i] = by_point;
        grad[0] = grad[0] + at.ray[i] * by_point;
    }
    grad[0] = grad[0] * Number(shape.zfar - shape.znear) * at.s * (Number(1) - at.s);

    const Number opacity = at.sigmoid(at.channel(shape.opacity()));
    grad[shape.opacity()] = grads[1][g];
    if (shape.activate)
        grad[shape.opacity()] = grad[shape.opacity()] * opacity * (Number(1) - opacity);
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t c = at.scale_channel(i);
        const Number by_scale(grads[2][3 * g + i]);
        grad[c] = grad[c] + (shape.activate ? by_scale * exp(at.channel(c)) : by_scale);
    }

    Four by_rotation;
    for (std::size_t i = 0; i < 4; ++i) by_rotation[i] = grads[3][4 * g + i];
    const Four conjugate = {at.camera[0], -at.camera[1], -at.camera[2], -at.camera[3]};
    const Four by_unit = at.product(conjugate, by_rotation);
    Number along(0);
    for (std::size_t i = 0; i < 4; ++i) along = along + at.unit[i] * by_unit[i];
    for (std::size_t i = 0; i < 4; ++i)
        grad[shape.opacity() + 4 + i] = number_of(at.norm) > 1e-12
                                            ? (by_unit[i] - at.unit[i] * along) / at.norm
                                            : by_unit[i] / Number(1e-12);

    const std::size_t dc = shape.opacity() + 8;
    const std::size_t first = 3 * shape.coefficients() * g;
    for (std::size_t rgb = 0; rgb < 3; ++rgb) {
        grad[dc + rgb] = grads[4][first + rgb];
        for (std::size_t s = 0; s + 1 < shape.coefficients(); ++s)
            for (std::size_t t = 0; t < 3; ++t)
                grad[dc + 3 + 3 * s + rgb] =
                    grad[dc + 3 + 3 * s + rgb] +
                    at.turn(s, t) * Number(grads[4][first + 3 + 3 * t + rgb]);
    }
    return grad;
}

/// [images,channels,pixels]
template <class Number>
std::vector<Number> gaussian_head_backward(const GaussianHeadInput& in,
                                           const GaussianHeadOutputs<double>& grads) {
    const GaussianHeadShape& shape = in.shape;
    std::vector<Number> grad_net_out(in.net_out.size());
    for (std::size_t g = 0; g < shape.gaussians(); ++g) {
        const std::size_t image = g / shape.pixels;
        const std::size_t pixel = g % shape.pixels;
        const GaussianHeadPixel<Number> at(in, image, pixel);
        const std::vector<Number> grad = gaussian_head_backward_pixel(shape, at, grads, g);
        for (std::size_t c = 0; c < grad.size(); ++c)
            grad_net_out[(image * shape.channels() + c) * shape.pixels + pixel] = grad[c];
    }
    return grad_net_out;
}

}  // namespace splat::ref
