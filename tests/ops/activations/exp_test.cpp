#include "ops/activations/exp.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Exp : public KernelsTest {
  protected:
    /// Both passes for gradients of 2: {y, grad_x}.
    std::vector<std::vector<float>> run(const std::vector<float>& x) {
        const Shape shape{static_cast<std::uint32_t>(x.size()), 1};
        const OpResult gpu = run_op(
            context(), sample("exp", Json::object(), {{shape, x}},
                              std::vector<HostTensor>{{shape, std::vector<float>(x.size(), 2)}}));
        EXPECT_OK(gpu.status);
        return {gpu.outputs.at(0), gpu.grad_inputs.at(0)};
    }
};
SPLAT_INSTANTIATE_KERNELS(Exp);

/// Vulkan's own exp may be 3 + 2|x| ulp off.
TEST_P(Exp, KeepsItsDigitsEverywhere) {
    std::vector<float> x;
    for (float at = -87.3F; at < 88; at += 0.0071F) x.push_back(at);
    const auto gpu = run(x);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double exact = std::exp(static_cast<double>(x[i]));
        ASSERT_NEAR(gpu[0][i], exact, 2e-7 * exact) << "x = " << x[i];
        ASSERT_NEAR(gpu[1][i], 2 * exact, 4e-7 * exact) << "x = " << x[i];
    }
}

TEST_P(Exp, HasTheLimitsOfFloats) {
    const float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto y = run({-infinity, -3e38F, -104, -88, 0, 88.72F, 88.73F, 3e38F, infinity, nan})[0];
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(y[i], 0) << i;
    EXPECT_NEAR(y[3], 0, FLT_MIN);  // may be flushed
    EXPECT_EQ(y[4], 1);
    EXPECT_NEAR(y[5], std::exp(static_cast<double>(88.72F)), 1e32);
    for (std::size_t i = 6; i < 9; ++i) EXPECT_EQ(y[i], infinity) << i;
    EXPECT_TRUE(std::isnan(y[9])) << "NaN disappeared";
}

}  // namespace
}  // namespace splat::test
