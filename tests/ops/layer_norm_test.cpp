#include "ops/layer_norm.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class LayerNorm : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(LayerNorm);

OpCall norm_of(const Shape& x, std::uint64_t seed, double mean = 0.5, double std = 1.5) {
    return sample("layer_norm", {{"eps", 1e-5}},
                  {normal_tensor(x, seed, mean, std), normal_tensor({x[1]}, seed + 1, 1, 0.3),
                   normal_tensor({x[1]}, seed + 2, 0, 0.5)},
                  {x});
}

TEST_P(LayerNorm, MatchesFloat64) {
    std::uint64_t seed = 100;
    for (const Shape& shape :
         {Shape{1, 1, 1, 2}, Shape{1, 4, 1, 1}, Shape{2, 8, 1, 1}, Shape{1, 3, 1, 17},
          Shape{2, 5, 9}, Shape{1, 6, 15, 17}, Shape{3, 7, 5, 7}, Shape{2, 16}, Shape{2, 33, 3, 3},
          Shape{1, 129, 1, 3}, Shape{5, 1027}, Shape{1, 384, 37, 3}, Shape{3, 2, 2050}}) {
        const OpCall call = norm_of(shape, seed += 4);
        const OpExpected expected = expected_of(call);
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status) << shape.text();
        const std::string how = reproduce(shape.text());
        EXPECT_TRUE(
            matches(gpu.outputs[0], expected.outputs[0], tolerance("layer_norm", "y"), {"y", how}));
        // Nothing reaches x or gamma of one channel, whose xhat is 0, and almost nothing x of two.
        for (const auto& [i, name] :
             {std::pair(0, "grad_x"), {1, "grad_gamma"}, {2, "grad_beta"}}) {
            const Tolerance& limit = tolerance("layer_norm", name);
            const Subject what{name, how, true, i < 2 && shape[1] == 1};
            EXPECT_TRUE(i == 0 && shape[1] == 2
                            ? within_bound(gpu.grad_inputs[i], expected.grad_inputs[i], limit, what)
                            : matches(gpu.grad_inputs[i], expected.grad_inputs[i], limit, what));
        }
    }
}

/// The mean is stored in two parts, as group_norm does it.
TEST_P(LayerNorm, KeepsDigitsBesideALargeMean) {
    for (const double mean : {1e2, -1e3, 1e4}) {
        const OpCall call = norm_of({2, 18, 5, 13}, 300, mean, 1);
        const OpExpected expected = expected_of(call);
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status);
        double worst = 0;
        for (std::size_t i = 0; i < gpu.outputs[0].size(); ++i)
            worst = std::max(worst, std::abs(static_cast<double>(gpu.outputs[0][i]) -
                                             expected.outputs[0].value[i]));
        EXPECT_LT(worst, 1e-5) << mean;
    }
}

TEST_P(LayerNorm, SurvivesExtremes) {
    const Shape shape{1, 6, 4};
    OpCall call = norm_of(shape, 400);
    std::vector<float>& x = call.inputs[0].values;
    for (std::size_t c = 0; c < 6; ++c) {
        x[4 * c] = 3e38F;                            // no deviation at all
        x[4 * c + 1] = c % 2 == 0 ? 1e38F : -1e38F;  // squares overflow
        x[4 * c + 2] = 1e-38F * static_cast<float>(c);
        x[4 * c + 3] = 0;
    }
    const OpExpected expected = expected_of(call);
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    const std::vector<float>& beta = call.inputs[2].values;
    for (std::size_t c = 0; c < 6; ++c) {
        EXPECT_EQ(gpu.outputs[0][4 * c], beta[c]);
        EXPECT_NEAR(gpu.outputs[0][4 * c + 1], expected.outputs[0].value[4 * c + 1], 2e-6);
        EXPECT_NEAR(gpu.outputs[0][4 * c + 2], beta[c], 1e-6);
        EXPECT_EQ(gpu.outputs[0][4 * c + 3], beta[c]);
    }
}

TEST_P(LayerNorm, RejectsBadArguments) {
    const auto status = [&](const Shape& x, std::uint32_t gamma, std::uint32_t beta, double eps) {
        return run_op(context(), sample("layer_norm", {{"eps", eps}},
                                        {normal_tensor(x, 1), normal_tensor({gamma}, 2),
                                         normal_tensor({beta}, 3)},
                                        std::vector<HostTensor>{}))
            .status;
    };
    EXPECT_OK(status({1, 3, 2}, 3, 3, 1e-6));
    EXPECT_ERROR(status({3}, 3, 3, 1e-6), Code::kShape, "'x'");
    EXPECT_ERROR(status({1, 3, 2}, 4, 3, 1e-6), Code::kShape, "'gamma'");
    EXPECT_ERROR(status({1, 3, 2}, 3, 2, 1e-6), Code::kShape, "'beta'");
    EXPECT_ERROR(status({1, 3, 2}, 3, 3, 0), Code::kInvalidArgument, "eps is 0");
    EXPECT_ERROR(status({1, 3, 2}, 3, 3, -1), Code::kInvalidArgument, "eps is -1");
}

TEST(LayerNormCheck, RefusesWhatLoopsCannotWalk) {
    EXPECT_OK(ops::layer_norm_check({{1, 65536, 1}, 1e-6F}));
    EXPECT_ERROR(ops::layer_norm_check({{1, 65537, 1}, 1e-6F}), Code::kUnsupported, "65537 chan");
    EXPECT_OK(ops::layer_norm_check({{4, 4, 1 << 22}, 1e-6F}));
    EXPECT_ERROR(ops::layer_norm_check({{5, 4, 1 << 22}, 1e-6F}), Code::kUnsupported, "pixels");
}

TEST(LayerNormReference, GradcheckFloat64) {
    for (const Shape& shape : {Shape{2, 6, 2, 3}, Shape{1, 3, 1, 1}, Shape{2, 5}})
        expect_gradcheck(norm_of(shape, 600));
}

}  // namespace
}  // namespace splat::test
