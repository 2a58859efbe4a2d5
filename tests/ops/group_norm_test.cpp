#include "ops/group_norm.h"

#include <gtest/gtest.h>

#include <cmath>

#include "group_norm_case.h"
#include "support/gradcheck.h"

namespace splat::test {
namespace {

class GroupNorm : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GroupNorm);

/// One element per group: xhat is 0 and nothing reaches x or gamma.
bool is_degenerate(const GroupNormCase& c) {
    return c.group_elements() == 1;
}

/// The saved means, without the rests of their rounding behind them.
std::vector<float> means(const OpResult& gpu) {
    return {gpu.saved[0].begin(),
            gpu.saved[0].begin() + static_cast<std::ptrdiff_t>(gpu.saved[0].size() / 2)};
}

void expect_forward(vk::Context& context, const GroupNormCase& c) {
    OpCall call = c.call();
    call.grad_outputs.clear();
    const OpResult gpu = run_op(context, call);
    ASSERT_OK(gpu.status) << c.text();
    const auto reference = ref::group_norm_forward(c.reference());
    const std::string how = reproduce(c.text());
    EXPECT_TRUE(matches(gpu.outputs[0], reference.y, tolerance("group_norm", "y"), {"y", how}));
    EXPECT_TRUE(
        matches(means(gpu), reference.mean, tolerance("group_norm", "mean"), {"mean", how}));
    EXPECT_TRUE(
        matches(gpu.saved[1], reference.rstd, tolerance("group_norm", "rstd"), {"rstd", how}));
}

void expect_backward(vk::Context& context, const GroupNormCase& c) {
    const OpResult gpu = run_op(context, c.call());
    ASSERT_OK(gpu.status) << c.text();
    const ref::Sums expected = expected_of(c.call()).grad_inputs;
    for (const auto& [i, name] : {std::pair(0, "grad_x"), {1, "grad_gamma"}, {2, "grad_beta"}})
        EXPECT_TRUE(matches(gpu.grad_inputs[i], expected[i], tolerance("group_norm", name),
                            {name, reproduce(c.text()), true, i < 2 && is_degenerate(c)}));
}

TEST_P(GroupNorm, ForwardMatchesFloat64) {
    std::uint64_t seed = 100;
    for (const NormShape& shape : kNormShapes) {
        expect_forward(context(), GroupNormCase(shape, false, ++seed));
        expect_forward(context(), GroupNormCase(shape, true, ++seed));
    }
}

TEST_P(GroupNorm, BackwardMatchesFloat64) {
    std::uint64_t seed = 200;
    for (const NormShape& shape : kNormBackwardShapes) {
        expect_backward(context(), GroupNormCase(shape, false, ++seed));
        expect_backward(context(), GroupNormCase(shape, true, ++seed));
    }
}

TEST_P(GroupNorm, LargeMeanKeepsPrecision) {
    for (const double mean : {1.0, 1e2, 1e3, -1e3})
        for (const NormShape& shape : {NormShape{1, 8, 64, 64, 2}, NormShape{2, 6, 15, 17, 3}}) {
            const GroupNormCase c(shape, false, 300, mean, 1);
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status);
            const auto reference = ref::group_norm_forward(c.reference());
            for (std::size_t g = 0; g < reference.rstd.value.size(); ++g)
                EXPECT_NEAR(static_cast<double>(gpu.saved[1][g]) / reference.rstd.value[g], 1, 1e-6)
                    << "rstd[" << g << "], mean " << mean << ", " << c.text();
            // y contains the rounding of the mean itself, 2^-24 * mean, so the figure for the whole
            // tensor does not apply.
            EXPECT_TRUE(within_bound(gpu.outputs[0], reference.y, tolerance("group_norm", "y"),
                                     {"y", reproduce(c.text())}));
        }
}

/// ||gpu - ref|| / ||ref||, without the allowance of relative_l2() for cancelling terms.
double error_of(const std::vector<float>& gpu, const std::vector<double>& reference) {
    double error = 0;
    double norm = 0;
    for (std::size_t i = 0; i < reference.size(); ++i) {
        const double difference = static_cast<double>(gpu[i]) - reference[i];
        error += difference * difference;
        norm += reference[i] * reference[i];
    }
    return std::sqrt(error / norm);
}

/// The mean itself may be half an ulp off, 3e-5 of the standard deviation at 1e3; the results may not.
TEST_P(GroupNorm, LargeMeanKeepsPrecisionOfResults) {
    for (const auto& [mean, most] : {std::pair(1e3, 1e-6), {-1e4, 1e-5}, {1e6, 1e-5}})
        for (const NormShape& shape : {NormShape{1, 8, 64, 64, 2}, NormShape{2, 6, 15, 17, 3}})
            for (const bool silu : {false, true}) {
                const GroupNormCase c(shape, silu, 310, mean, 1);
                const OpResult gpu = run_op(context(), c.call());
                ASSERT_OK(gpu.status);
                const auto forward = ref::group_norm_forward(c.reference());
                const auto backward = ref::group_norm_backward(c.reference(), to_double(c.grad_y));
                SCOPED_TRACE(c.text() + " mean " + std::to_string(mean));
                EXPECT_LE(error_of(gpu.outputs[0], forward.y.value), most);
                EXPECT_LE(error_of(gpu.grad_inputs[0], backward.grad_x.value), most);
                EXPECT_LE(error_of(gpu.grad_inputs[1], backward.grad_gamma.value), most);
                EXPECT_LE(error_of(gpu.grad_inputs[2], backward.grad_beta.value), most);
            }
}

TEST_P(GroupNorm, ConstantInputGivesBetaExactly) {
    for (const float constant : {0.0F, 1.0F, 0.1F, 1000.1F, -3e4F, 1e-30F, 1.7e18F, 3.4e38F})
        for (const NormShape& shape : {NormShape{2, 6, 3, 7, 2}, NormShape{1, 64, 5, 5, 16},
                                       NormShape{1, 3, 33, 31, 1}, NormShape{1, 8, 63, 65, 1}}) {
            GroupNormCase c(shape, false, 400);
            c.x.assign(c.x.size(), constant);
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status);
            std::vector<float> beta(c.x.size());
            const auto reference = c.reference();
            for (std::size_t i = 0; i < beta.size(); ++i)
                beta[i] = c.beta[reference.shape.channel(i)];
            const std::string how = reproduce(c.text() + " constant " + std::to_string(constant));
            EXPECT_TRUE(bit_equal(gpu.outputs[0], beta, {"y", how}));
            for (const auto& gradient : gpu.grad_inputs)
                EXPECT_TRUE(all_finite(gradient, {"gradient", how}));
            for (const float gradient : gpu.grad_inputs[1]) EXPECT_EQ(gradient, 0) << how;
        }
}

TEST_P(GroupNorm, ConstantInputWithSiluGivesSiluOfBeta) {
    GroupNormCase c({2, 8, 3, 7, 2}, true, 410);
    c.x.assign(c.x.size(), 0.1F);
    const OpResult gpu = run_op(context(), c.call());
    ASSERT_OK(gpu.status);
    auto zero_mean = c.reference();
    zero_mean.x.assign(zero_mean.x.size(), 0);  // the same y, without the rounding of the mean in S
    const auto reference = ref::group_norm_forward(zero_mean);
    EXPECT_TRUE(matches(gpu.outputs[0], reference.y, tolerance("group_norm", "y"),
                        {"y", reproduce(c.text())}));
}

TEST_P(GroupNorm, OneElementPerGroupGivesBeta) {
    GroupNormCase c({2, 12, 1, 1, 12}, false, 420);
    const OpResult gpu = run_op(context(), c.call());
    ASSERT_OK(gpu.status);
    for (std::size_t i = 0; i < c.x.size(); ++i) EXPECT_EQ(gpu.outputs[0][i], c.beta[i % 12]);
    for (const float gradient : gpu.grad_inputs[0]) EXPECT_EQ(gradient, 0);
    expect_backward(context(), c);
}

TEST_P(GroupNorm, HugeInputsAreExact) {
    for (const double scale : {1e15, 1e18, 2e19, 1e25, 5e37})  // squares overflow from 1.8e19 on
        for (const bool silu : {false, true}) {
            GroupNormCase c({1, 8, 17, 33, 2}, silu, 430, 0, scale);
            for (float& g : c.grad_y) g *= 1e6F;  // gradients that devices may not flush to 0
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status);
            const std::string how = reproduce(c.text() + " scale " + std::to_string(scale));
            EXPECT_TRUE(all_finite(gpu.outputs[0], {"y", how}));
            EXPECT_TRUE(all_finite(gpu.saved[0], {"mean", how}));
            EXPECT_TRUE(all_finite(gpu.saved[1], {"rstd", how}));
            for (const auto& gradient : gpu.grad_inputs)
                EXPECT_TRUE(all_finite(gradient, {"gradient", how}));
            const auto forward = ref::group_norm_forward(c.reference());
            const auto backward = ref::group_norm_backward(c.reference(), to_double(c.grad_y));
            EXPECT_TRUE(
                matches(gpu.outputs[0], forward.y, tolerance("group_norm", "y"), {"y", how}));
            EXPECT_LE(error_of(gpu.saved[1], forward.rstd.value), 1e-6) << how;
            EXPECT_LE(error_of(gpu.grad_inputs[0], backward.grad_x.value), 5e-6) << how;
            EXPECT_LE(error_of(gpu.grad_inputs[1], backward.grad_gamma.value), 5e-6) << how;
        }
}

TEST_P(GroupNorm, ExtremeActivationsStayFinite) {
    GroupNormCase c({1, 8, 5, 5, 2}, true, 440);
    const float extremes[] = {100, -100, 0.0F, -0.0F, 1e-30F, -1e-30F, 3e38F, -3e38F};
    std::copy(std::begin(extremes), std::end(extremes), c.beta.begin());
    const OpResult gpu = run_op(context(), c.call());
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(all_finite(gpu.outputs[0], {"y", reproduce("extreme beta")}));
    for (const auto& gradient : gpu.grad_inputs)
        EXPECT_TRUE(all_finite(gradient, {"gradient", reproduce("extreme beta")}));
    for (std::size_t p = 0; p < 25; ++p) {
        EXPECT_EQ(gpu.outputs[0][7 * 25 + p], 0) << "silu(-3e38)";
        EXPECT_EQ(gpu.grad_inputs[0][7 * 25 + p], gpu.grad_inputs[0][7 * 25 + p]);
    }
    EXPECT_EQ(gpu.grad_inputs[2][7], 0) << "no slope at -3e38";
}

TEST_P(GroupNorm, AdjointIdentityInGammaAndBeta) {
    std::uint64_t seed = 500;
    for (const NormShape& shape : kNormBackwardShapes) {  // without SiLU y is linear in them
        const GroupNormCase c(shape, false, ++seed);
        const OpResult gpu = run_op(context(), c.call());
        ASSERT_OK(gpu.status);
        const double left = dot(to_double(gpu.outputs[0]), to_double(c.grad_y));
        const double right = dot(to_double(c.gamma), to_double(gpu.grad_inputs[1])) +
                             dot(to_double(c.beta), to_double(gpu.grad_inputs[2]));
        double scale = 0;  // magnitude of the sums, which may cancel
        for (std::size_t i = 0; i < c.grad_y.size(); ++i)
            scale +=
                std::abs(static_cast<double>(gpu.outputs[0][i]) * static_cast<double>(c.grad_y[i]));
        EXPECT_NEAR(left, right, 1e-5 * scale) << c.text();
    }
}

TEST_P(GroupNorm, GradientIsOrthogonalToShifts) {
    const GroupNormCase c({2, 12, 9, 8, 3}, true,
                          510);  // y does not change when x moves as a whole
    const OpResult gpu = run_op(context(), c.call());
    ASSERT_OK(gpu.status);
    const auto shape = c.reference().shape;
    std::vector<double> sum(6, 0);
    std::vector<double> magnitude(6, 0);
    for (std::size_t i = 0; i < c.x.size(); ++i) {
        const auto gradient = static_cast<double>(gpu.grad_inputs[0][i]);
        sum[shape.group(i)] += gradient;
        magnitude[shape.group(i)] += std::abs(gradient);
    }
    for (std::size_t g = 0; g < sum.size(); ++g)
        EXPECT_LE(std::abs(sum[g]), 1e-6 * magnitude[g]) << g;
}

}  // namespace
}  // namespace splat::test
