#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Difference of edges, forward and backward:
///
///   d = a - b      Dx(y, x) = sum over v, u in -1..1 of u s(v) d(r(y + v), r(x + u)),  Dy: u and v exchanged
///   loss = mean of weight (|Dx| + |Dy|)
///
/// s is the smoothing filter. r reflects an index at the border pixels. Each tap adds
/// g weight (u s(v) sign Dx + v s(u) sign Dy) / elements to the gradient of the pixel of `a` that it reads.
/// The magnitudes hold the rounding of d, which |a| + |b| bounds. They do not hold a sign that rounding changes,
/// so inputs keep Dx and Dy away from 0.
namespace splat::ref {

struct EdgeLossInput {
    std::size_t images = 1, channels = 1, height = 1, width = 1;
    bool scharr = false;
    std::vector<double> a, b;    ///< [images,channels,height,width]
    std::vector<double> weight;  ///< [images,height,width]; empty: 1
};

/// Number of terms of a derivative.
inline constexpr std::size_t kEdgeTaps = 9;

inline std::size_t edge_reflected(std::size_t at, int by, std::size_t size) {
    const auto to = static_cast<std::ptrdiff_t>(at) + by;
    const auto last = static_cast<std::ptrdiff_t>(size) - 1;
    if (last == 0) return 0;
    return static_cast<std::size_t>(to < 0 ? -to : to > last ? 2 * last - to : to);
}

/// Calls use(pixel q, its factor in Dx, its factor in Dy) for the taps of pixel p.
template <class Use>
void edge_taps(const EdgeLossInput& in, std::size_t p, const Use& use) {
    const std::size_t x = p % in.width, y = p / in.width % in.height;
    const auto smoothing = [&](int tap) {
        return tap == 0 ? (in.scharr ? 10.0 / 32 : 2.0 / 8) : (in.scharr ? 3.0 / 32 : 1.0 / 8);
    };
    for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u)
            use(p - y * in.width - x + edge_reflected(y, v, in.height) * in.width +
                    edge_reflected(x, u, in.width),
                u * smoothing(v), v * smoothing(u));
}

inline double edge_weight(const EdgeLossInput& in, std::size_t p) {
    const std::size_t plane = in.height * in.width;
    return in.weight.empty() ? 1 : in.weight[p / (in.channels * plane) * plane + p % plane];
}

inline Summed<double> edge_loss_forward(const EdgeLossInput& in) {
    Summed<double> loss(1, in.a.size() * kEdgeTaps);
    const auto elements = static_cast<double>(in.a.size());
    for (std::size_t p = 0; p < in.a.size(); ++p) {
        double dx = 0, dy = 0, wide = 0;
        edge_taps(in, p, [&](std::size_t q, double by_x, double by_y) {
            const double d = in.a[q] - in.b[q];
            dx += by_x * d;
            dy += by_y * d;
            wide += (std::abs(by_x) + std::abs(by_y)) * (std::abs(in.a[q]) + std::abs(in.b[q]));
        });
        const double weight = edge_weight(in, p) / elements;
        loss.add(0, weight * (std::abs(dx) + std::abs(dy)), std::abs(weight) * wide);
    }
    return loss;
}

inline Summed<double> edge_loss_backward(const EdgeLossInput& in, double grad_loss) {
    Summed<double> grad_a(in.a.size(), 2 * kEdgeTaps);
    const auto sign = [](double d) { return d > 0 ? 1.0 : d < 0 ? -1.0 : 0.0; };
    for (std::size_t p = 0; p < in.a.size(); ++p) {
        double dx = 0, dy = 0;
        edge_taps(in, p, [&](std::size_t q, double by_x, double by_y) {
            dx += by_x * (in.a[q] - in.b[q]);
            dy += by_y * (in.a[q] - in.b[q]);
        });
        const double weight = grad_loss * edge_weight(in, p) / static_cast<double>(in.a.size());
        edge_taps(in, p, [&](std::size_t q, double by_x, double by_y) {
            grad_a.add(q, weight * (by_x * sign(dx) + by_y * sign(dy)),
                       std::abs(weight) * (std::abs(by_x) + std::abs(by_y)));
        });
    }
    return grad_a;
}

inline EdgeLossInput edge_loss_input(const OpArguments& in) {
    const OpTensor& a = in.inputs[0];
    return {a.dim(0),          a.dim(1), a.dim(2),     a.dim(3),
            in.flag("scharr"), a.values, in.values(1), in.values(2)};
}

inline OpExample edge_loss_example(OpExample of, const OpInput& weight, const char* attributes) {
    of.inputs.push_back(weight);
    of.attributes = attributes;
    return of;
}

inline constexpr OpRef kEdgeLossRef{
    .name = "edge_loss",
    .forward = [](const OpArguments& in) -> Sums {
        return {edge_loss_forward(edge_loss_input(in))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {edge_loss_backward(edge_loss_input(in), grads[0][0]), {}, {}};
    },
    .examples =
        [] {
            const OpExample images = image_loss_examples()[0];
            return std::vector{
                edge_loss_example(images, {{}, 0, 1, true}, "{}"),
                edge_loss_example(images, {{2, 1, 9, 13}, 1, 1, true}, R"({"scharr": true})")};
        },
    .sizes =
        [] {
            return std::vector{edge_loss_example(image_loss_sizes()[0], {{}, 0, 1, true}, "{}")};
        }};

}  // namespace splat::ref
