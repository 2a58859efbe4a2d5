#include "ops/activations/sigmoid.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"
#include "ref/rounded.h"

namespace splat::test {
namespace {

class Sigmoid : public KernelsTest {
  protected:
    /// Both passes for gradients of 1: {y, grad_x}.
    std::vector<std::vector<float>> run(const std::vector<float>& x) {
        const Shape shape{static_cast<std::uint32_t>(x.size()), 1};
        const OpResult gpu = run_op(
            context(), sample("sigmoid", Json::object(), {{shape, x}},
                              std::vector<HostTensor>{{shape, std::vector<float>(x.size(), 1)}}));
        EXPECT_OK(gpu.status);
        return {gpu.outputs.at(0), gpu.grad_inputs.at(0)};
    }
};
SPLAT_INSTANTIATE_KERNELS(Sigmoid);

/// 1 - s would leave no digit of the slope above 17. The exponential of a slope has 3 roundings, so does the square of
/// 1 + e, and a quotient follows.
TEST_P(Sigmoid, KeepsItsDigitsInTheTails) {
    std::vector<float> x;
    for (float at = -87; at < 87; at += 0.0071F) x.push_back(at);
    const auto gpu = run(x);
    constexpr double kSlope = 0x1p-24 * (6 + ref::kQuotientRoundings);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double s = 1 / (1 + std::exp(-static_cast<double>(x[i])));
        const double rest = 1 / (1 + std::exp(static_cast<double>(x[i])));
        ASSERT_NEAR(gpu[0][i], s, 4e-7 * s) << "x = " << x[i];
        ASSERT_NEAR(gpu[1][i], s * rest, kSlope * s * rest) << "x = " << x[i];
    }
}

TEST_P(Sigmoid, HasTheLimitsAtInfinity) {
    const float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> x = {-infinity, -3e38F, -104, 0, 17.5F, 3e38F, infinity, nan};
    const auto gpu = run(x);
    for (std::size_t i = 0; i < 7; ++i)
        EXPECT_EQ(gpu[0][i], x[i] == 0 ? 0.5F : x[i] > 0 ? 1 : 0) << "sigmoid(" << x[i] << ")";
    for (const std::size_t i : {0, 1, 2, 5, 6}) EXPECT_EQ(gpu[1][i], 0) << "slope at " << x[i];
    EXPECT_EQ(gpu[1][3], 0.25F);
    for (const auto& values : gpu) EXPECT_TRUE(std::isnan(values[7])) << "NaN disappeared";
}

}  // namespace
}  // namespace splat::test
