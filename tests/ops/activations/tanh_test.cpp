#include "ops/activations/tanh.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Tanh : public KernelsTest {
  protected:
    /// Both passes for gradients of 1: {y, grad_x}.
    std::vector<std::vector<float>> run(const std::vector<float>& x) {
        const Shape shape{static_cast<std::uint32_t>(x.size()), 1};
        const OpResult gpu = run_op(
            context(), sample("tanh", Json::object(), {{shape, x}},
                              std::vector<HostTensor>{{shape, std::vector<float>(x.size(), 1)}}));
        EXPECT_OK(gpu.status);
        return {gpu.outputs.at(0), gpu.grad_inputs.at(0)};
    }
};
SPLAT_INSTANTIATE_KERNELS(Tanh);

/// 1 - exp(-2x) would lose the digits of small numbers, 1 - y^2 those of the slope where y is 1.
TEST_P(Tanh, KeepsItsDigitsEverywhere) {
    std::vector<float> x;
    for (float at = -43; at < 43; at += 0.0071F) x.push_back(at);
    for (float at = 1e-30F; at < 1; at *= 1.7F) x.push_back(at);
    const auto gpu = run(x);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const auto at = static_cast<double>(x[i]);
        const double slope = 1 / std::cosh(at) / std::cosh(at);
        ASSERT_NEAR(gpu[0][i], std::tanh(at), 5e-7 * std::abs(std::tanh(at))) << "x = " << x[i];
        ASSERT_NEAR(gpu[1][i], slope, 7e-7 * slope) << "x = " << x[i];
    }
}

TEST_P(Tanh, HasTheLimitsAtInfinity) {
    const float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> x = {-infinity, -3e38F, -53, 0, 53, 3e38F, infinity, nan};
    const auto gpu = run(x);
    for (std::size_t i = 0; i < 7; ++i) {
        EXPECT_EQ(gpu[0][i], x[i] < 0 ? -1 : x[i] > 0 ? 1 : 0) << x[i];
        EXPECT_NEAR(gpu[1][i], x[i] == 0 ? 1 : 0, FLT_MIN) << x[i];  // may be flushed
    }
    for (const auto& values : gpu) EXPECT_TRUE(std::isnan(values[7])) << "NaN disappeared";
}

}  // namespace
}  // namespace splat::test
