#include "ops/images/max_pool2d.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class MaxPool2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(MaxPool2d);

Shape half(const Shape& shape) {
    return {shape[0], shape[1], shape[2] / 2, shape[3] / 2};
}

TEST_P(MaxPool2d, MatchesFloat64) {
    std::uint64_t seed = 10;
    std::vector<Shape> shapes = {Shape{1, 1, 2, 2}, Shape{2, 3, 4, 6}, Shape{2, 6, 7, 5},
                                 Shape{3, 5, 2, 9}, Shape{1, 3, 257, 2}};
    for (const Shape& shape : image_shapes())  // an edge of one pixel has no window
        if (shape.rank() == 4 && shape[2] > 1 && shape[3] > 1) shapes.push_back(shape);
    ASSERT_GE(shapes.size(), 24U);
    for (const Shape& shape : shapes) {
        const OpCall call =
            sample("max_pool2d", Json::object(), {normal_tensor(shape, ++seed)}, {half(shape)});
        const OpExpected expected = expected_of(call);
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status) << shape.text();
        const std::string how = reproduce(shape.text());
        EXPECT_TRUE(exact(gpu.outputs[0], expected.outputs[0], {"y", how}));
        // Three of four gradients are zero, and more at odd edges.
        EXPECT_TRUE(
            exact(gpu.grad_inputs[0], expected.grad_inputs[0], {"grad_x", how, true, true}));
    }
}

/// Among equal values the first one counts, row by row.
TEST_P(MaxPool2d, GivesTheGradientToOne) {
    const OpCall call =
        sample("max_pool2d", Json::object(), {{{1, 1, 2, 6}, {5, 5, 0, 7, 1, 2, 5, 5, 7, 7, 3, 3}}},
               std::vector<HostTensor>{{{1, 1, 1, 3}, {1, 2, 3}}});
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0], (std::vector<float>{5, 7, 3}));
    EXPECT_EQ(gpu.grad_inputs[0], (std::vector<float>{1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 3, 0}));
}

TEST_P(MaxPool2d, RejectsBadShapes) {
    const auto status = [&](const Shape& shape) {
        return run_op(context(), sample("max_pool2d", Json::object(), {normal_tensor(shape, 1)},
                                        std::vector<HostTensor>{}))
            .status;
    };
    EXPECT_ERROR(status({1, 1, 1, 4}), Code::kShape, "1 x 4");
    EXPECT_ERROR(status({1, 1, 4, 1}), Code::kShape, "4 x 1");
    EXPECT_ERROR(status({1, 1, 4}), Code::kShape, "'x'");
}

TEST(MaxPool2dReference, GradcheckFloat64) {
    expect_gradcheck(sample("max_pool2d", Json::object(), {normal_tensor({1, 2, 5, 4}, 1, 0, 3)},
                            {Shape{1, 2, 2, 2}}));
}

}  // namespace
}  // namespace splat::test
