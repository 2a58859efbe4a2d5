#include "ops/activations/relu.h"

#include <gtest/gtest.h>

#include <cfloat>

#include "ops/every/op_samples.h"
#include "ref/activations/relu_ref.h"

namespace splat::test {
namespace {

class Relu : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Relu);

TEST_P(Relu, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const Shape& shape : image_shapes()) {
        const OpCall call =
            sample("relu", Json::object(), {normal_tensor(shape, ++seed, 1, 2)}, {shape});
        const std::vector<double> x = to_double(call.inputs[0].values);
        expect_matches(context(), call, {ref::relu_forward(x)},
                       {ref::relu_backward(x, to_double(call.grad_outputs[0].values))},
                       shape.text());
    }
}

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

TEST_P(Relu, RejectsBadShapes) {
    EXPECT_ERROR(
        run_op(context(), sample("relu", Json::object(), {normal_tensor({6}, 1)}, {Shape{6}}))
            .status,
        Code::kShape, "channels");
}

TEST(ReluReference, GradcheckFloat64) {
    const std::vector<double> x = to_double(normal_fill(40, 1, 0, 3));
    const std::vector<double> grad_y = to_double(normal_fill(40, 2));
    expect_gradcheck({x}, [](const Arrays& in) { return Arrays{ref::relu_forward(in[0]).value}; },
                     {grad_y}, {ref::relu_backward(x, grad_y).value});
}

}  // namespace
}  // namespace splat::test
