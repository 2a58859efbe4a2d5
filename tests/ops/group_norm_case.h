#pragma once

#include "ops/op_harness.h"
#include "ref/group_norm_ref.h"
#include "support/rng_fill.h"
#include "support/shapes.h"

namespace splat::test {

/// Inputs of one group_norm call, for the device and for the reference.
struct GroupNormCase {
    NormShape shape;
    float eps = 1e-5F;
    bool silu = false;
    std::vector<float> x;
    std::vector<float> gamma;
    std::vector<float> beta;
    std::vector<float> grad_y;

    /// Normal x with the given mean and standard deviation, gamma near 1, beta near 0.
    GroupNormCase(const NormShape& s, bool with_silu, std::uint64_t seed, double mean = 0.5,
                  double std = 1.5)
        : shape(s),
          silu(with_silu),
          x(normal_fill(s.elements(), seed, mean, std)),
          gamma(normal_fill(s.C, seed + 1, 1, 0.3)),
          beta(normal_fill(s.C, seed + 2, 0, 0.5)),
          grad_y(normal_fill(s.elements(), seed + 3)) {}

    [[nodiscard]] std::string text() const { return shape.text() + (silu ? " silu" : ""); }

    [[nodiscard]] OpCall call() const {
        const Shape nchw{shape.N, shape.C, shape.H, shape.W};
        OpCall call;
        call.op = "group_norm";
        call.attributes = {{"groups", shape.G}, {"eps", eps}, {"silu", silu}};
        call.inputs = {{nchw, x}, {{shape.C}, gamma}, {{shape.C}, beta}};
        call.grad_outputs = {{nchw, grad_y}};
        return call;
    }

    [[nodiscard]] ref::GroupNormInput<double> reference() const {
        const std::size_t pixels = std::size_t{shape.H} * shape.W;
        return {{shape.N, shape.C, pixels, shape.G},
                static_cast<double>(eps),
                silu,
                to_double(x),
                to_double(gamma),
                to_double(beta)};
    }

    /// Elements that one group normalises over.
    [[nodiscard]] std::size_t group_elements() const {
        return shape.elements() / shape.N / shape.G;
    }
};

}  // namespace splat::test
