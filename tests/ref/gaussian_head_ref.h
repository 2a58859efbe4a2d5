#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "params/gaussian_head_params.h"
#include "ref/op_ref.h"
#include "ref/rounded.h"

/// Turns network output into Gaussians, in plain loops; Number is double, or Rounded for the magnitudes too.
///
/// Forward, per Gaussian, with M the camera's row-vector matrix and a its quaternion:
///
///   d = sigmoid(c0) (most - least) + least + origin, or the input's depth      p = ray d + point
///   in a box: p = clamp(point, least, most), M and a those of the world
///   r = [p, 1] M      mean = r.xyz / (r.w + 1e-10)
///   opacity, scale = activated, f(c)
///   rotation = a * q / max(|q|, 1e-12)
///   sh_0 = colour, or (f(c) - 1/2) / kSh0
///   sh_t = sum_s c_s T[s][t],  T = V^T M3 V,  V = [[0,0,-1],[-1,0,0],[0,1,0]]
///
/// Backward, G the gradient of each result, w = r.w + 1e-10:
///
///   by r: (G_mean, -G_mean . mean) / w, as d mean / d w = -mean / w      by p_i = M_i . (by r)
///   by point: by p, in a box where c is inside      by c0: (ray . by p) (most - least) s (1 - s)
///   by what is activated: f'(c) G
///   by the unit quaternion u: conj(a) * G (the transpose of the product with a)
///   by q: (by u - u (u . by u)) / |q| where |q| > 1e-12, as du/dq = (1 - u u^T) / |q|, else by u / 1e-12
///   by c_s: sum_t G_t T[s][t]
namespace splat::ref {

struct GaussianHeadShape {
    std::size_t images = 1;
    std::size_t pixels = 1;
    HeadLayout layout;

    [[nodiscard]] std::size_t gaussians() const { return images * pixels * layout.per_pixel; }
};

/// The constant basis function: a direct colour is 1/2 + kHeadSh0 sh.
inline constexpr double kHeadSh0 = 0.28209479177387814;

struct GaussianHeadInput {
    GaussianHeadShape shape;
    std::vector<double> net_out;        ///< [images,channels,pixels]
    std::vector<double> rays;           ///< [3,pixels]
    std::vector<double> view_to_world;  ///< [images,4,4]
    std::vector<double> quaternion;     ///< [images,4]
    std::vector<double> focal;          ///< [images,2] or empty
    std::vector<double> origin;         ///< [images] or empty; depths [images,pixels]
};

/// Results or gradients: means, opacities, scales, rotations, sh, in the order of the operator's ports.
template <class Number>
using GaussianHeadOutputs = std::array<std::vector<Number>, 5>;

template <class Number>
Number head_sigmoid(const Number& x) {
    using std::exp;
    return Number(1) / (Number(1) + exp(-x));
}

inline double log1p_of(double x) {
    return std::log1p(x);
}
/// The relative errors of a kernel's logarithm and of its argument are of some roundings.
inline Rounded log1p_of(const Rounded& x) {
    const double value = std::log1p(x.value);
    return {value, x.magnitude / (1 + x.value) + 4 * std::abs(value)};
}

/// What an activation makes of a channel, and its derivative.
template <class Number>
Number activated(std::uint32_t activation, const Number& x) {
    using std::exp;
    switch (activation) {
        case kHeadSigmoid:
            return head_sigmoid(x);
        case kHeadExp:
            return exp(x);
        case kHeadSoftplus: {
            const bool positive = number_of(x) > 0;
            const Number small = log1p_of(exp(positive ? -x : x));
            return (positive ? x + small : small) / Number(10);
        }
        case kHeadTanh:
            return head_sigmoid(Number(2) * x);
        default:
            return x;
    }
}

template <class Number>
Number slope(std::uint32_t activation, const Number& x) {
    using std::exp;
    const Number s = head_sigmoid(x);
    switch (activation) {
        case kHeadSigmoid:
            return s * (Number(1) - s);
        case kHeadExp:
            return exp(x);
        case kHeadSoftplus:
            return s / Number(10);
        case kHeadTanh: {  // 1 - s would lose its digits
            const Number e = exp(Number(number_of(x) > 0 ? -2 : 2) * x);
            return Number(2) * e / ((Number(1) + e) * (Number(1) + e));
        }
        default:
            return Number(1);
    }
}

/// One Gaussian's inputs and the values that both directions need.
template <class Number>
class GaussianHeadPoint {
  public:
    using Four = std::array<Number, 4>;

    /// Gaussian g, counted over images, pixels, and the Gaussians of a pixel.
    GaussianHeadPoint(const GaussianHeadInput& input, std::size_t g)
        : in_(input),
          layout_(input.shape.layout),
          image_(g / layout_.per_pixel / input.shape.pixels),
          pixel_(g / layout_.per_pixel % input.shape.pixels),
          first_(g % layout_.per_pixel * layout_.channels_of_one()) {
        for (std::size_t j = 0; j < 4; ++j) world[j] = matrix(3, j);
        if (!layout_.absolute()) take_ray();
        for (std::size_t i = 0; i < 3; ++i) {
            const Number point = point_of(i);
            for (std::size_t j = 0; j < 4; ++j) world[j] = world[j] + point * matrix(i, j);
        }
        world[3] = world[3] + Number(1e-10);
        Number square(0);
        for (std::size_t i = 0; i < 4; ++i) {
            q[i] = channel(kHeadRotation, i);
            square = square + q[i] * q[i];
        }
        using std::sqrt;
        norm = sqrt(square);
        for (std::size_t i = 0; i < 4; ++i)
            unit[i] = q[i] / (number_of(norm) > 1e-12 ? norm : Number(1e-12));
        for (std::size_t i = 0; i < 4; ++i)
            camera[i] = layout_.absolute() ? (i == 0 ? 1 : 0) : in_.quaternion[4 * image_ + i];
    }

    /// The place of a block's channel in net_out.
    [[nodiscard]] std::size_t place(HeadBlockId block, std::size_t i) const {
        const std::size_t c = first_ + layout_.at(block) + i;
        return (image_ * layout_.channels() + c) * in_.shape.pixels + pixel_;
    }
    [[nodiscard]] Number channel(HeadBlockId block, std::size_t i = 0) const {
        return in_.net_out[place(block, i)];
    }
    [[nodiscard]] Number activated(HeadBlockId block, std::size_t i = 0) const {
        return ref::activated(layout_.blocks[block].activation, channel(block, i));
    }
    [[nodiscard]] Number slope(HeadBlockId block, std::size_t i = 0) const {
        return ref::slope(layout_.blocks[block].activation, channel(block, i));
    }
    [[nodiscard]] bool is_inside(std::size_t i) const {
        const double c = number_of(channel(kHeadPoint, i));
        return c >= static_cast<double>(layout_.least) && c <= static_cast<double>(layout_.most);
    }
    [[nodiscard]] Number matrix(std::size_t i, std::size_t j) const {
        if (layout_.absolute()) return Number(i == j ? 1 : 0);
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
        return layout_.isotropic ? 0 : i;
    }

    static Four product(const Four& a, const Four& b) {
        return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
    }

    std::array<Number, 3> ray;  ///< only where there is no box
    Number s;                   ///< sigmoid of the depth channel
    Four world;                 ///< r, with 1e-10 added to w
    Four q;
    Number norm;
    Four unit;
    Four camera;

  private:
    void take_ray() {
        const bool given = layout_.positions == kHeadInputDepth;
        for (std::size_t i = 0; i < 3; ++i) {
            ray[i] = in_.rays[i * in_.shape.pixels + pixel_];
            if (i < 2 && !in_.focal.empty()) ray[i] = ray[i] / Number(in_.focal[2 * image_ + i]);
        }
        if (given) {
            depth_ = in_.origin[image_ * in_.shape.pixels + pixel_];
            return;
        }
        const auto least = static_cast<double>(layout_.least);
        s = head_sigmoid(channel(kHeadDepth));
        depth_ = s * Number(static_cast<double>(layout_.most) - least) + Number(least);
        if (!in_.origin.empty()) depth_ = depth_ + Number(in_.origin[image_]);
    }
    [[nodiscard]] Number point_of(std::size_t i) const {
        if (!layout_.absolute())
            return layout_.offset ? ray[i] * depth_ + channel(kHeadPoint, i) : ray[i] * depth_;
        const Number c = channel(kHeadPoint, i);
        const auto least = static_cast<double>(layout_.least);
        if (is_inside(i)) return c;
        return Number(number_of(c) < least ? least : static_cast<double>(layout_.most));
    }

    const GaussianHeadInput& in_;
    const HeadLayout& layout_;
    std::size_t image_;
    std::size_t pixel_;
    std::size_t first_;  ///< channels of the pixel's Gaussians before this one
    Number depth_;
};

template <class Number>
GaussianHeadOutputs<Number> gaussian_head_forward(const GaussianHeadInput& in) {
    const HeadLayout& layout = in.shape.layout;
    GaussianHeadOutputs<Number> out;
    for (std::size_t g = 0; g < in.shape.gaussians(); ++g) {
        const GaussianHeadPoint<Number> at(in, g);
        for (std::size_t i = 0; i < 3; ++i) {
            out[0].push_back(at.world[i] / at.world[3]);
            out[2].push_back(at.activated(kHeadScale, at.scale_channel(i)));
        }
        out[1].push_back(at.activated(kHeadOpacity));
        for (const Number& value : at.product(at.camera, at.unit)) out[3].push_back(value);
        for (std::size_t rgb = 0; rgb < 3; ++rgb) {
            const Number colour = at.activated(kHeadColour, rgb);
            out[4].push_back(layout.direct ? (colour - Number(0.5)) / Number(kHeadSh0) : colour);
        }
        for (std::size_t t = 0; t + 1 < layout.coefficients(); ++t)
            for (std::size_t rgb = 0; rgb < 3; ++rgb) {
                Number sum(0);
                for (std::size_t s = 0; s < 3; ++s)
                    sum = sum + at.channel(kHeadRest, 3 * s + rgb) * at.turn(s, t);
                out[4].push_back(sum);
            }
    }
    return out;
}

/// Gradients of net_out by the blocks of one Gaussian: adds them.
template <class Number>
void add_colour_gradients(const HeadLayout& layout, const GaussianHeadPoint<Number>& at,
                          const double* by_sh, std::vector<Number>& grad) {
    for (std::size_t rgb = 0; rgb < 3; ++rgb) {
        Number by_colour(by_sh[rgb]);
        by_colour = by_colour * at.slope(kHeadColour, rgb);
        grad[at.place(kHeadColour, rgb)] = layout.direct ? by_colour / Number(kHeadSh0) : by_colour;
        for (std::size_t s = 0; s + 1 < layout.coefficients(); ++s) {
            Number& rest = grad[at.place(kHeadRest, 3 * s + rgb)];
            for (std::size_t t = 0; t < 3; ++t)
                rest = rest + at.turn(s, t) * Number(by_sh[3 + 3 * t + rgb]);
        }
    }
}

template <class Number>
void add_point_gradients(const HeadLayout& layout, const GaussianHeadPoint<Number>& at,
                         const double* by_mean, std::vector<Number>& grad) {
    std::array<Number, 4> by_world;
    by_world[3] = Number(0);
    for (std::size_t i = 0; i < 3; ++i) {
        by_world[i] = Number(by_mean[i]) / at.world[3];
        by_world[3] = by_world[3] - by_world[i] * (at.world[i] / at.world[3]);
    }
    Number by_depth(0);
    for (std::size_t i = 0; i < 3; ++i) {
        Number by_point(0);
        for (std::size_t j = 0; j < 4; ++j) by_point = by_point + at.matrix(i, j) * by_world[j];
        if (layout.absolute() ? at.is_inside(i) : layout.offset)
            grad[at.place(kHeadPoint, i)] = by_point;
        if (!layout.absolute()) by_depth = by_depth + at.ray[i] * by_point;
    }
    const double range = static_cast<double>(layout.most) - static_cast<double>(layout.least);
    if (layout.positions == kHeadRayDepth)
        grad[at.place(kHeadDepth, 0)] = by_depth * Number(range) * at.s * (Number(1) - at.s);
}

template <class Number>
void add_rotation_gradients(const GaussianHeadPoint<Number>& at, const double* by_rotation,
                            std::vector<Number>& grad) {
    const std::array<Number, 4> given = {by_rotation[0], by_rotation[1], by_rotation[2],
                                         by_rotation[3]};
    const std::array<Number, 4> conjugate = {at.camera[0], -at.camera[1], -at.camera[2],
                                             -at.camera[3]};
    const std::array<Number, 4> by_unit = at.product(conjugate, given);
    Number along(0);
    for (std::size_t i = 0; i < 4; ++i) along = along + at.unit[i] * by_unit[i];
    for (std::size_t i = 0; i < 4; ++i)
        grad[at.place(kHeadRotation, i)] = number_of(at.norm) > 1e-12
                                               ? (by_unit[i] - at.unit[i] * along) / at.norm
                                               : by_unit[i] / Number(1e-12);
}

/// [images,channels,pixels]
template <class Number>
std::vector<Number> gaussian_head_backward(const GaussianHeadInput& in,
                                           const GaussianHeadOutputs<double>& grads) {
    const HeadLayout& layout = in.shape.layout;
    std::vector<Number> grad(in.net_out.size(), Number(0));
    for (std::size_t g = 0; g < in.shape.gaussians(); ++g) {
        const GaussianHeadPoint<Number> at(in, g);
        add_point_gradients(layout, at, &grads[0][3 * g], grad);
        grad[at.place(kHeadOpacity, 0)] = Number(grads[1][g]) * at.slope(kHeadOpacity);
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t c = at.scale_channel(i);
            Number& by_scale = grad[at.place(kHeadScale, c)];
            by_scale = by_scale + Number(grads[2][3 * g + i]) * at.slope(kHeadScale, c);
        }
        add_rotation_gradients(at, &grads[3][4 * g], grad);
        add_colour_gradients(layout, at, &grads[4][3 * layout.coefficients() * g], grad);
    }
    return grad;
}

inline HeadLayout head_layout(const OpArguments& in) {
    HeadForm form;
    form.positions = static_cast<std::uint32_t>(in.count("positions"));
    form.offset = in.flag("offset");
    form.least = static_cast<float>(in.attribute("znear"));
    form.most = static_cast<float>(in.attribute("zfar"));
    form.scales = static_cast<std::uint32_t>(in.count("scales"));
    form.isotropic = in.flag("isotropic");
    form.sh_degree = static_cast<std::uint32_t>(in.count("sh_degree"));
    form.direct = in.flag("direct");
    form.activate = in.flag("activate");
    form.per_pixel = static_cast<std::uint32_t>(in.count("per_pixel"));
    return HeadLayout(form);
}

inline GaussianHeadInput head_input(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {{x.dim(0), x.pixels(), head_layout(in)},
            x.values,
            in.values(1),
            in.values(2),
            in.values(3),
            in.values(4),
            in.values(5)};
}

/// The usual head, with cameras at random: in focus of an origin, or of neither.
inline OpExample head_example(std::size_t n, std::size_t h, std::size_t w, std::size_t views,
                              bool focal) {
    const std::size_t batch = n / views, each = views * h * w;
    return {.inputs = {{{n, HeadLayout(HeadForm()).channels(), h, w}},
                       {{3, h, w}, 0, focal ? 40.0 : 1.0, true},
                       {{n, 4, 4}, 0, 0.5, true},
                       {{n, 4}, 0.5, 0.25, true},
                       {focal ? Dims{n, 2} : Dims{}, 40, 2, true},
                       {focal ? Dims{n} : Dims{}, 2, 0.1, true}},
            .outputs = {{batch, each, 3},
                        {batch, each, 1},
                        {batch, each, 3},
                        {batch, each, 4},
                        {batch, each, 4, 3}},
            .attributes = "{\"views\": " + std::to_string(views) + "}",
            .title = text_of({n, HeadLayout(HeadForm()).channels(), h, w}),
            .change = [](std::vector<std::vector<float>>& inputs) {
                // The last column of a pose gives w = 1; rays of pixels end at 1.
                for (std::size_t i = 3; i < inputs[2].size(); i += 4)
                    inputs[2][i] = i % 16 == 15 ? 1.0F : 0.0F;
                if (!inputs[4].empty())
                    std::fill(inputs[1].end() - static_cast<std::ptrdiff_t>(inputs[1].size() / 3),
                              inputs[1].end(), 1.0F);
            }};
}

inline constexpr OpRef kGaussianHeadRef{
    .name = "gaussian_head",
    .forward = [](const OpArguments& in) -> Sums {
        Sums outputs;
        for (const auto& values : gaussian_head_forward<Rounded>(head_input(in)))
            outputs.push_back(summed(values));
        return outputs;
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        GaussianHeadOutputs<double> given;
        for (std::size_t i = 0; i < given.size(); ++i) given[i] = grads[i];
        Sums sums(in.inputs.size());
        sums[0] = summed(gaussian_head_backward<Rounded>(head_input(in), given));
        return sums;
    },
    .examples =
        [] {
            return std::vector{head_example(2, 5, 7, 1, false), head_example(4, 5, 7, 2, true)};
        },
    .sizes = [] { return std::vector{head_example(1, 128, 128, 1, false)}; }};

}  // namespace splat::ref
