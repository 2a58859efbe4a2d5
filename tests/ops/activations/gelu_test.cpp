#include "ops/activations/gelu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ops/op_harness.h"
#include "ref/activations/gelu_ref.h"

namespace splat::test {
namespace {

class Gelu : public KernelsTest {
  protected:
    /// Both passes for gradients of 1: {y, grad_x}.
    std::vector<std::vector<float>> run(const std::vector<float>& x, bool by_tanh) {
        const Shape shape{static_cast<std::uint32_t>(x.size()), 1};
        const OpResult gpu = run_op(
            context(), sample("gelu", {{"tanh", by_tanh}}, {{shape, x}},
                              std::vector<HostTensor>{{shape, std::vector<float>(x.size(), 1)}}));
        EXPECT_OK(gpu.status);
        return {gpu.outputs.at(0), gpu.grad_inputs.at(0)};
    }
};
SPLAT_INSTANTIATE_KERNELS(Gelu);

/// Values of the definition with 16 digits, from tables of the normal distribution and of tanh.
TEST_P(Gelu, HasTheValuesOfTheDefinition) {
    const auto exact = run({-1, 0, 1, 2}, false);
    const auto by_tanh = run({-1, 0, 1, 2}, true);
    const double expected[] = {-0.15865525393145705, 0, 0.8413447460685429, 1.9544997361036416};
    const double approximate[] = {-0.15880800939172324, 0, 0.8411919906082768, 1.9545976940877752};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(exact[0][i], expected[i], 2e-7 * std::abs(expected[i]));
        EXPECT_NEAR(by_tanh[0][i], approximate[i], 4e-7 * std::abs(approximate[i]));
    }
    EXPECT_NEAR(exact[1][1], 0.5, 1e-7);
    EXPECT_NEAR(by_tanh[1][1], 0.5, 1e-7);
}

/// Every digit of y is right relative to y itself, however small it is: an approximation of erf with a bound
/// on the absolute error would have none left below -5.
TEST_P(Gelu, KeepsItsDigitsInTheTails) {
    std::vector<float> x;
    for (float at = -13; at < 13; at += 0.0071F) x.push_back(at);
    const ref::Summed<double> expected = ref::gelu_forward(to_double(x), false);
    const std::vector<float> y = run(x, false)[0];
    for (std::size_t i = 0; i < x.size(); ++i)
        ASSERT_NEAR(y[i], expected.value[i], 5e-7 * std::abs(expected.value[i])) << "x = " << x[i];
}

TEST_P(Gelu, SurvivesAnyFiniteInput) {
    for (const bool by_tanh : {false, true}) {
        const auto gpu = run({-3e38F, -1e20F, -1e4F, -100, -20, 20, 100, 3e38F}, by_tanh);
        for (std::size_t i = 0; i < 5; ++i) {
            EXPECT_NEAR(gpu[0][i], 0, 1e-37) << i;
            EXPECT_NEAR(gpu[1][i], 0, 1e-37) << i;
        }
        EXPECT_EQ(gpu[0][5], 20);
        EXPECT_EQ(gpu[0][6], 100);
        EXPECT_EQ(gpu[0][7], 3e38F);
        for (std::size_t i = 5; i < 8; ++i) EXPECT_EQ(gpu[1][i], 1) << i;
    }
}

TEST_P(Gelu, PassesNanOn) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    for (const bool by_tanh : {false, true}) {
        const auto gpu = run({nan, -nan, inf, -inf}, by_tanh);
        for (const std::vector<float>& values : gpu) {
            EXPECT_TRUE(std::isnan(values[0]) && std::isnan(values[1])) << by_tanh;
            EXPECT_EQ(values[3], 0) << by_tanh;
        }
        EXPECT_EQ(gpu[0][2], inf);
        EXPECT_EQ(gpu[1][2], 1);
    }
}

}  // namespace
}  // namespace splat::test
