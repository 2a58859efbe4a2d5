#include "ops/activations/relu.h"

#include <gtest/gtest.h>

#include <cfloat>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Relu : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Relu);

/// At 0 the slope is 0, as PyTorch has it. The least numbers are normal: devices may flush others to 0.
TEST_P(Relu, HasNoSlopeAtZero) {
    const OpCall call = sample("relu", Json::object(), {{{1, 4}, {-0.0F, 0.0F, FLT_MIN, -FLT_MIN}}},
                               std::vector<HostTensor>{{{1, 4}, {1, 2, 3, 4}}});
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.grad_inputs[0], (std::vector<float>{0, 0, 3, 0}));
}

TEST_P(Relu, KeepsNaN) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    const OpResult gpu = run_op(
        context(), sample("relu", Json::object(), {{{1, 4}, {nan, -nan, infinity, -infinity}}},
                          std::vector<HostTensor>{}));
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(std::isnan(gpu.outputs[0][0]) && std::isnan(gpu.outputs[0][1]));
    EXPECT_EQ(gpu.outputs[0][2], infinity);
    EXPECT_EQ(gpu.outputs[0][3], 0.0F);
}

}  // namespace
}  // namespace splat::test
