#pragma once

#include <cmath>

#include "ops/op_harness.h"
#include "ref/conv2d_ref.h"
#include "support/rng_fill.h"
#include "support/shapes.h"

namespace splat::test {

/// Inputs of one conv2d call, for the device and for the reference.
struct Conv2dCase {
    ConvShape shape;
    std::vector<float> x;
    std::vector<float> weight;
    std::vector<float> bias;
    std::vector<float> residual;
    std::vector<float> grad_y;
    float scale = 1;
    int winograd = 0;
    bool replicate = false;

    /// With a bias and a residual, and the factor sqrt(0.5) of a residual block.
    static Conv2dCase normal(const ConvShape& s, std::uint64_t seed) {
        return {s,
                normal_fill(s.x(), seed),
                normal_fill(s.weights(), seed + 1),
                normal_fill(s.K, seed + 2),
                normal_fill(s.y(), seed + 3),
                normal_fill(s.y(), seed + 4),
                std::sqrt(0.5F)};
    }
    /// The convolution alone.
    static Conv2dCase bare(const ConvShape& s, std::uint64_t seed) {
        Conv2dCase c = normal(s, seed);
        c.bias.clear();
        c.residual.clear();
        c.scale = 1;
        return c;
    }
    static Conv2dCase integers(const ConvShape& s, std::uint64_t seed) {
        return {s,
                integer_fill(s.x(), seed),
                integer_fill(s.weights(), seed + 1),
                integer_fill(s.K, seed + 2),
                integer_fill(s.y(), seed + 3),
                integer_fill(s.y(), seed + 4),
                0.5F};
    }

    [[nodiscard]] OpCall call() const {
        const Shape y{shape.N, shape.K, shape.H, shape.W};
        OpCall call;
        call.op = "conv2d";
        call.attributes = {{"scale", scale}, {"winograd", winograd}, {"replicate", replicate}};
        call.inputs = {{{shape.N, shape.C, shape.H, shape.W}, x},
                       {{shape.K, shape.C, shape.R, shape.R}, weight},
                       {bias.empty() ? Shape{} : Shape{shape.K}, bias},
                       {residual.empty() ? Shape{} : y, residual}};
        call.grad_outputs = {{y, grad_y}};
        return call;
    }
    [[nodiscard]] OpCall forward() const {
        OpCall forward = call();
        forward.grad_outputs.clear();
        return forward;
    }
    [[nodiscard]] std::string text() const {
        return shape.text() + (bias.empty() ? " no bias" : "") +
               (residual.empty() ? " no residual" : "") +
               (winograd == 0 ? "" : " winograd=" + std::to_string(winograd)) +
               (replicate ? " replicate" : "");
    }
    /// The row of a result in tolerances.h.
    [[nodiscard]] const Tolerance& tolerance_of(const char* result) const {
        return tolerance(winograd == 4   ? "conv2d_winograd4"
                         : winograd == 2 ? "conv2d_winograd2"
                                         : "conv2d",
                         result);
    }
    /// A reference with the magnitudes that the algorithm's rounding follows.
    [[nodiscard]] ref::Summed<double> bounded(ref::Summed<double> sums) const {
        return winograd == 0 ? sums : ref::mixed(std::move(sums));
    }
};

/// The algorithms that a set of kernels has for a shape.
inline std::vector<int> winograds(vk::Kernels kernels, const ConvShape& shape) {
    if (kernels == vk::Kernels::kPlain || shape.R == 1) return {0};
    return {0, 2, 4};
}

}  // namespace splat::test
