#include "ops/activations/softplus.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Softplus : public KernelsTest {
  protected:
    /// Both passes for gradients of 1: {y, grad_x}.
    std::vector<std::vector<float>> run(const std::vector<float>& x) {
        const Shape shape{static_cast<std::uint32_t>(x.size()), 1};
        const OpResult gpu = run_op(
            context(), sample("softplus", Json::object(), {{shape, x}},
                              std::vector<HostTensor>{{shape, std::vector<float>(x.size(), 1)}}));
        EXPECT_OK(gpu.status);
        return {gpu.outputs.at(0), gpu.grad_inputs.at(0)};
    }
};
SPLAT_INSTANTIATE_KERNELS(Softplus);

/// log(1 + exp(x)) as it is written would be 0 below -17, and infinite above 88.
TEST_P(Softplus, KeepsItsDigitsInTheTails) {
    std::vector<float> x;
    for (float at = -87; at < 120; at += 0.0071F) x.push_back(at);
    const auto gpu = run(x);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const auto at = static_cast<double>(x[i]);
        const double y = std::max(at, 0.0) + std::log1p(std::exp(-std::abs(at)));
        const double slope = 1 / (1 + std::exp(-at));
        ASSERT_NEAR(gpu[0][i], y, 6e-7 * y) << "x = " << x[i];
        ASSERT_NEAR(gpu[1][i], slope, 4e-7 * slope) << "x = " << x[i];
    }
}

TEST_P(Softplus, HasTheLimitsAtInfinity) {
    const float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto gpu = run({-infinity, -3e38F, -105, 0, 20, 3e38F, infinity, nan});
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(gpu[0][i], 0) << i;
        EXPECT_EQ(gpu[1][i], 0) << i;
    }
    EXPECT_NEAR(gpu[0][3], 0.693147181, 3e-7);
    EXPECT_EQ(gpu[1][3], 0.5F);
    EXPECT_EQ(gpu[0][4], 20);  // what PyTorch has above 20
    EXPECT_EQ(gpu[0][5], 3e38F);
    EXPECT_EQ(gpu[0][6], infinity);
    for (std::size_t i = 5; i < 7; ++i) EXPECT_EQ(gpu[1][i], 1) << i;
    for (const auto& values : gpu) EXPECT_TRUE(std::isnan(values[7])) << "NaN disappeared";
}

}  // namespace
}  // namespace splat::test
