#include "ops/activations/silu.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

class Silu : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Silu);

TEST_P(Silu, SurvivesAnyFiniteInput) {
    OpCall call =
        sample("silu", Json::object(), {{{2, 4}, {-3e38F, -1e4F, -100, -89, 0, 89, 1e4F, 3e38F}}},
               std::vector<HostTensor>{{{2, 4}, std::vector<float>(8, 1)}});
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(all_finite(gpu.outputs[0], {"y", reproduce("large")}));
    EXPECT_TRUE(all_finite(gpu.grad_inputs[0], {"grad_x", reproduce("large")}));
    EXPECT_EQ(gpu.outputs[0][4], 0);
    EXPECT_EQ(gpu.outputs[0][7], 3e38F);
    EXPECT_EQ(gpu.grad_inputs[0][6], 1);
    EXPECT_EQ(gpu.grad_inputs[0][4], 0.5F);
    EXPECT_NEAR(gpu.outputs[0][2], 0, 1e-30);
}

TEST_P(Silu, HasTheLimitsAtInfinity) {
    const float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> x = {-infinity, -3e38F, -1e30F, -1e4F, infinity, 3e38F, 1e30F, nan};
    const OpResult gpu =
        run_op(context(), sample("silu", Json::object(), {{{2, 4}, x}},
                                 std::vector<HostTensor>{{{2, 4}, std::vector<float>(8, 1)}}));
    ASSERT_OK(gpu.status);
    for (std::size_t i = 0; i < 7; ++i) {
        EXPECT_EQ(gpu.outputs[0][i], std::max(x[i], 0.0F)) << "silu(" << x[i] << ")";
        EXPECT_EQ(gpu.grad_inputs[0][i], x[i] > 0 ? 1 : 0) << "slope at " << x[i];
    }
    EXPECT_TRUE(std::isnan(gpu.outputs[0][7])) << "NaN disappeared";
    EXPECT_TRUE(std::isnan(gpu.grad_inputs[0][7])) << "NaN disappeared";
}

TEST_P(Silu, IsAccurateInBothTails) {
    const std::vector<float> x = {-86, -60, -30, -12, 12, 30, 60, 86};
    const OpResult gpu =
        run_op(context(), sample("silu", Json::object(), {{{2, 4}, x}},
                                 std::vector<HostTensor>{{{2, 4}, std::vector<float>(8, 1)}}));
    ASSERT_OK(gpu.status);
    for (std::size_t i = 0; i < 8; ++i) {
        const auto t = static_cast<double>(x[i]);
        const double s = 1 / (1 + std::exp(-t)), slope = s + t * s / (1 + std::exp(t));
        EXPECT_NEAR(static_cast<double>(gpu.outputs[0][i]) / (t * s), 1, 1e-6)
            << "silu(" << t << ")";
        EXPECT_NEAR(static_cast<double>(gpu.grad_inputs[0][i]) / slope, 1, 1e-6) << "at " << t;
    }
}

TEST_P(Silu, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("norm", [&](const Golden& golden) {
        const HostTensor x = golden_tensor(golden.npz, "silu.x");
        const OpResult gpu =
            run_op(context(), sample("silu", Json::object(), {x},
                                     std::vector<HostTensor>{golden_tensor(golden.npz, "silu.g")}));
        ASSERT_OK(gpu.status);
        const std::string how = reproduce(golden.name);
        EXPECT_TRUE(close(gpu.outputs[0], golden.doubles("silu.y64"), kGoldenLayer, kGoldenLayer,
                          {"y", how}));
        EXPECT_TRUE(close(gpu.grad_inputs[0], golden.doubles("silu.d_x64"), kGoldenLayer,
                          kGoldenLayer, {"grad_x", how, true}));
    });
}

}  // namespace
}  // namespace splat::test
