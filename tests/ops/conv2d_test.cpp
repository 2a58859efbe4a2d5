#include "ops/conv2d.h"

#include <gtest/gtest.h>

#include "conv2d_case.h"

namespace splat::test {
namespace {

class Conv2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Conv2d);

void expect_gradients(const Conv2dCase& c, const ref::Sums& expected, const OpResult& gpu) {
    const std::string how = reproduce(c.text());
    EXPECT_TRUE(matches(gpu.grad_inputs[0], c.bounded(expected[0]), c.tolerance_of("grad_x"),
                        {"grad_x", how, true}));
    EXPECT_TRUE(matches(gpu.grad_inputs[1], c.bounded(expected[1]), c.tolerance_of("grad_weight"),
                        {"grad_weight", how, true, c.shape.H * c.shape.W < 3}));
    for (const auto& [i, name] : {std::pair(2, "grad_bias"), {3, "grad_residual"}})
        if (c.call().inputs[i].values.empty())
            EXPECT_TRUE(gpu.grad_inputs[i].empty());
        else
            EXPECT_TRUE(matches(gpu.grad_inputs[i], expected[i], tolerance("conv2d", name),
                                {name, how, true}));
}

TEST_P(Conv2d, ForwardMatchesFloat64) {
    std::uint64_t seed = 100;
    for (const ConvShape& shape : kConvShapes) {
        seed += 5;
        Conv2dCase c =
            seed % 3 != 0 ? Conv2dCase::normal(shape, seed) : Conv2dCase::bare(shape, seed);
        const ref::Summed<double> expected = expected_of(c.forward()).outputs[0];
        for (const int winograd : winograds(GetParam(), shape)) {
            c.winograd = winograd;
            const OpResult gpu = run_op(context(), c.forward());
            ASSERT_OK(gpu.status) << c.text();
            EXPECT_TRUE(matches(gpu.outputs[0], c.bounded(expected), c.tolerance_of("y"),
                                {"y", reproduce(c.text())}));
        }
    }
}

TEST_P(Conv2d, BackwardMatchesFloat64) {
    std::uint64_t seed = 300;
    for (const ConvShape& shape : kConvBackwardShapes) {
        seed += 5;
        Conv2dCase c =
            seed % 3 != 0 ? Conv2dCase::normal(shape, seed) : Conv2dCase::bare(shape, seed);
        const ref::Sums expected = expected_of(c.call()).grad_inputs;
        for (const int winograd : winograds(GetParam(), shape)) {
            c.winograd = winograd;
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status) << c.text();
            expect_gradients(c, expected, gpu);
        }
    }
}

/// Directly, and by F(2x2), whose transforms multiply by 1/2 and 1/4. The factors of F(4x4) are not
/// exact in float32.
TEST_P(Conv2d, IntegersAreExact) {
    std::uint64_t seed = 500;
    for (const ConvShape& shape : kConvBackwardShapes) {  // sums stay below 2^22
        Conv2dCase c = Conv2dCase::integers(shape, seed += 5);
        const bool tiny = shape.H * shape.W < 5;  // few taps lie in the image
        for (const int winograd : winograds(GetParam(), shape)) {
            c.winograd = winograd;
            if (winograd != 4) expect_exact(context(), c.call(), c.text(), tiny);
        }
    }
}

TEST_P(Conv2d, AdjointIdentity) {
    std::uint64_t seed = 700;
    for (const ConvShape& shape : kConvBackwardShapes)
        for (const int winograd : winograds(GetParam(), shape)) {
            Conv2dCase c = Conv2dCase::bare(shape, seed += 5);
            c.winograd = winograd;
            expect_adjoint(context(), c.call(), {0, 1}, c.text());
        }
}

/// Tiles that end with the image and beyond it, images of one pixel or row, few output channels.
constexpr ConvShape kReplicatedShapes[] = {
    {1, 1, 1, 1, 1, 3}, {1, 5, 1, 7, 3, 3}, {2, 9, 9, 6, 17, 3}, {1, 8, 8, 8, 8, 3}};

TEST_P(Conv2d, ReplicatedBorderMatchesFloat64) {
    std::uint64_t seed = 1100;
    for (const ConvShape& shape : kReplicatedShapes) {
        Conv2dCase c = Conv2dCase::normal(shape, seed += 5);
        c.replicate = true;
        const OpExpected expected = expected_of(c.call());
        for (const int winograd : winograds(GetParam(), shape)) {
            c.winograd = winograd;
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status) << c.text();
            EXPECT_TRUE(matches(gpu.outputs[0], c.bounded(expected.outputs[0]), c.tolerance_of("y"),
                                {"y", reproduce(c.text())}));
            expect_gradients(c, expected.grad_inputs, gpu);
            Conv2dCase bare = Conv2dCase::bare(shape, seed);
            bare.winograd = winograd;
            bare.replicate = true;
            expect_adjoint(context(), bare.call(), {0, 1}, c.text());
        }
    }
}

TEST(Conv2dReference, GradcheckFloat64) {
    std::uint64_t seed = 900;
    for (const ConvShape& shape :
         {ConvShape{1, 1, 1, 1, 1, 3}, ConvShape{2, 3, 4, 5, 2, 3}, ConvShape{2, 3, 2, 2, 4, 1}})
        expect_gradcheck(Conv2dCase::normal(shape, seed += 5).call());
    for (const ConvShape& shape : {ConvShape{1, 1, 1, 1, 1, 3}, ConvShape{2, 3, 4, 5, 2, 3}}) {
        Conv2dCase c = Conv2dCase::normal(shape, seed += 5);
        c.replicate = true;
        expect_gradcheck(c.call());
    }
}

}  // namespace
}  // namespace splat::test
