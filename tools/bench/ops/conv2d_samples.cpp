#include "bench/ops/conv2d_samples.h"

#include <algorithm>

namespace vkrun::bench {
namespace {

constexpr std::size_t kMostSamples = 256;

/// A convolution of one image, as tests/ref/conv2d_ref.h defines it.
struct Conv {
    std::size_t C, H, W, K, R;
    const std::vector<float>& x;
    const std::vector<float>& weight;
    const std::vector<float>& bias;
    const std::vector<float>& residual;
    const std::vector<float>& grad_y;

    [[nodiscard]] std::size_t taps() const { return R * R; }

    /// Calls visit(row of x, column of x) if output (i, j) has tap (r, s) there.
    template <class Visit>
    void tap(std::size_t i, std::size_t j, std::size_t r, std::size_t s, const Visit& visit) const {
        const std::size_t u = i + r - R / 2;  // wraps far beyond H
        const std::size_t v = j + s - R / 2;
        if (u < H && v < W) visit(u, v);
    }
};

double product(float a, float b) {
    return static_cast<double>(a) * static_cast<double>(b);
}

/// The first and last elements, and others at equal distances that are not a multiple of a tile.
Samples sample(std::size_t count, std::size_t terms) {
    Samples samples;
    const std::size_t most = std::min(count, kMostSamples);
    for (std::size_t i = 0; i < most; ++i)
        samples.elements.push_back(most < 2 ? 0 : i * (count - 1) / (most - 1));
    samples.sums = splat::ref::Summed<double>(most, terms);
    return samples;
}

Samples sample_y(const Conv& conv) {
    Samples samples = sample(conv.grad_y.size(), conv.C * conv.taps() + 2);
    for (std::size_t n = 0; n < samples.elements.size(); ++n) {
        const std::size_t at = samples.elements[n];
        const std::size_t k = at / (conv.H * conv.W);
        for (std::size_t c = 0; c < conv.C; ++c)
            for (std::size_t t = 0; t < conv.taps(); ++t)
                conv.tap(at / conv.W % conv.H, at % conv.W, t / conv.R, t % conv.R,
                         [&](std::size_t u, std::size_t v) {
                             samples.sums.add(
                                 n, product(conv.weight[(k * conv.C + c) * conv.taps() + t],
                                            conv.x[(c * conv.H + u) * conv.W + v]));
                         });
        samples.sums.add(n, static_cast<double>(conv.bias[k]));
        samples.sums.add(n, static_cast<double>(conv.residual[at]));
    }
    return samples;
}

Samples sample_grad_x(const Conv& conv) {
    Samples samples = sample(conv.x.size(), conv.K * conv.taps());
    for (std::size_t n = 0; n < samples.elements.size(); ++n) {
        const std::size_t at = samples.elements[n];
        const std::size_t c = at / (conv.H * conv.W);
        for (std::size_t k = 0; k < conv.K; ++k)
            for (std::size_t t = 0; t < conv.taps(); ++t)  // tap t of the output on the other side
                conv.tap(at / conv.W % conv.H, at % conv.W, conv.R - 1 - t / conv.R,
                         conv.R - 1 - t % conv.R, [&](std::size_t i, std::size_t j) {
                             samples.sums.add(
                                 n, product(conv.weight[(k * conv.C + c) * conv.taps() + t],
                                            conv.grad_y[(k * conv.H + i) * conv.W + j]));
                         });
    }
    return samples;
}

Samples sample_grad_weight(const Conv& conv) {
    Samples samples = sample(conv.weight.size(), conv.H * conv.W);
    for (std::size_t n = 0; n < samples.elements.size(); ++n) {
        const std::size_t t = samples.elements[n] % conv.taps();
        const std::size_t c = samples.elements[n] / conv.taps() % conv.C;
        const std::size_t k = samples.elements[n] / conv.taps() / conv.C;
        for (std::size_t i = 0; i < conv.H; ++i)
            for (std::size_t j = 0; j < conv.W; ++j)
                conv.tap(i, j, t / conv.R, t % conv.R, [&](std::size_t u, std::size_t v) {
                    samples.sums.add(n, product(conv.grad_y[(k * conv.H + i) * conv.W + j],
                                                conv.x[(c * conv.H + u) * conv.W + v]));
                });
    }
    return samples;
}

}  // namespace

CaseReference sampled_reference_of(const OpCase& op_case) {
    if (op_case.op != "conv2d" || op_case.attributes.value("replicate", false))
        return reference_of(op_case);
    const auto dim = [&](std::size_t axis) {
        return static_cast<std::size_t>(op_case.inputs[0].dims[axis]);
    };
    const std::vector<float>& grad_y = op_case.outputs[0].values;
    const Conv conv{dim(1),
                    dim(2),
                    dim(3),
                    static_cast<std::size_t>(op_case.outputs[0].dims[1]),
                    static_cast<std::size_t>(op_case.inputs[1].dims[2]),
                    op_case.inputs[0].values,
                    op_case.inputs[1].values,
                    op_case.inputs[2].values,
                    op_case.inputs[3].values,
                    grad_y};
    splat::ref::Summed<double> bias(conv.K, conv.H * conv.W);
    splat::ref::Summed<double> residual(grad_y.size(), 1);
    for (std::size_t i = 0; i < grad_y.size(); ++i) {
        bias.add(i / (conv.H * conv.W), static_cast<double>(grad_y[i]));
        residual.add(i, static_cast<double>(grad_y[i]));
    }
    CaseReference result;
    result.outputs.emplace_back(sample_y(conv));
    result.grad_inputs = {sample_grad_x(conv), sample_grad_weight(conv), bias, residual};
    return result;
}

}  // namespace vkrun::bench
