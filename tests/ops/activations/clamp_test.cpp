#include "ops/activations/clamp.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Clamp : public KernelsTest {
  protected:
    OpResult run(const Json& attributes, const std::vector<float>& x) {
        const Shape shape{static_cast<std::uint32_t>(x.size()), 1};
        return run_op(context(),
                      sample("clamp", attributes, {{shape, x}},
                             std::vector<HostTensor>{{shape, std::vector<float>(x.size(), 2)}}));
    }
};
SPLAT_INSTANTIATE_KERNELS(Clamp);

/// At the bounds themselves the gradient passes, as PyTorch has it.
TEST_P(Clamp, PassesTheGradientAtTheBounds) {
    const float above = std::nextafter(0.5F, 1.0F);
    const float below = std::nextafter(-0.25F, -1.0F);
    const OpResult gpu =
        run({{"least", -0.25}, {"most", 0.5}}, {below, -0.25F, 0, 0.5F, above, -3e38F, 3e38F});
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0], (std::vector<float>{-0.25F, -0.25F, 0, 0.5F, 0.5F, -0.25F, 0.5F}));
    EXPECT_EQ(gpu.grad_inputs[0], (std::vector<float>{0, 2, 2, 2, 0, 0, 0}));
}

TEST_P(Clamp, KeepsNanAndBoundsInfinity) {
    const float infinity = std::numeric_limits<float>::infinity();
    const std::vector<float> x = {infinity, -infinity, std::numeric_limits<float>::quiet_NaN()};
    const OpResult gpu = run({{"least", -1}, {"most", 1}}, x);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0][0], 1);
    EXPECT_EQ(gpu.outputs[0][1], -1);
    EXPECT_TRUE(std::isnan(gpu.outputs[0][2]));
    EXPECT_EQ(gpu.grad_inputs[0], (std::vector<float>{0, 0, 0}));
}

TEST_P(Clamp, RejectsBadBounds) {
    EXPECT_OK(run({{"least", 1}, {"most", 1}}, {3}).status);
    EXPECT_ERROR(run({{"least", 1}, {"most", 0.5}}, {3}).status, Code::kInvalidArgument,
                 "least is 1 and most is 0.5");
    EXPECT_ERROR(run({{"most", 1e39}}, {3}).status, Code::kInvalidArgument, "1e+39");
    EXPECT_ERROR(run({{"least", -1e39}}, {3}).status, Code::kInvalidArgument, "-1e+39");
}

}  // namespace
}  // namespace splat::test
