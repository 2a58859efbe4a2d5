#include "ops/conv2d.h"

#include <gtest/gtest.h>

#include "conv2d_case.h"
#include "support/gradcheck.h"

namespace splat::test {
namespace {

class Conv2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Conv2d);

void expect_gradients(const Conv2dCase& c, const ref::Conv2dBackward<double>& expected,
                      const OpResult& gpu) {
    const std::string how = reproduce(c.text());
    EXPECT_TRUE(matches(gpu.grad_inputs[0], c.bounded(expected.grad_x), c.tolerance_of("grad_x"),
                        {"grad_x", how, true}));
    EXPECT_TRUE(matches(gpu.grad_inputs[1], c.bounded(expected.grad_weight),
                        c.tolerance_of("grad_weight"),
                        {"grad_weight", how, true, c.shape.H * c.shape.W < 3}));
    if (c.bias.empty())
        EXPECT_TRUE(gpu.grad_inputs[2].empty());
    else
        EXPECT_TRUE(matches(gpu.grad_inputs[2], expected.grad_bias,
                            tolerance("conv2d", "grad_bias"), {"grad_bias", how, true}));
    if (c.residual.empty())
        EXPECT_TRUE(gpu.grad_inputs[3].empty());
    else
        EXPECT_TRUE(matches(gpu.grad_inputs[3], expected.grad_residual,
                            tolerance("conv2d", "grad_residual"), {"grad_residual", how, true}));
}

TEST_P(Conv2d, ForwardMatchesFloat64) {
    std::uint64_t seed = 100;
    for (const ConvShape& shape : kConvShapes) {
        seed += 5;
        Conv2dCase c =
            seed % 3 != 0 ? Conv2dCase::normal(shape, seed) : Conv2dCase::bare(shape, seed);
        const auto expected = ref::conv2d_forward(c.reference());
        for (const int winograd : winograds(GetParam(), shape)) {
            c.winograd = winograd;
            OpCall call = c.call();
            call.grad_outputs.clear();
            const OpResult gpu = run_op(context(), call);
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
        const auto expected = ref::conv2d_backward(c.reference(), to_double(c.grad_y));
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
        const auto y = ref::conv2d_forward(c.reference());
        const auto gradients = ref::conv2d_backward(c.reference(), to_double(c.grad_y));
        const bool tiny = shape.H * shape.W < 5;  // few taps lie in the image
        for (const int winograd : winograds(GetParam(), shape)) {
            if (winograd == 4) continue;
            c.winograd = winograd;
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status) << c.text();
            const std::string how = reproduce(c.text());
            const auto same = [&](std::size_t input, const ref::Summed<double>& expected,
                                  const char* name) {
                EXPECT_TRUE(exact(gpu.grad_inputs[input], expected, {name, how, true, tiny}));
            };
            EXPECT_TRUE(exact(gpu.outputs[0], y, {"y", how, false, tiny}));
            same(0, gradients.grad_x, "grad_x");
            same(1, gradients.grad_weight, "grad_weight");
            same(2, gradients.grad_bias, "grad_bias");
            same(3, gradients.grad_residual, "grad_residual");
        }
    }
}

TEST_P(Conv2d, AdjointIdentity) {
    std::uint64_t seed = 700;
    for (const ConvShape& shape : kConvBackwardShapes)
        for (const int winograd : winograds(GetParam(), shape)) {
            Conv2dCase c = Conv2dCase::bare(shape, seed += 5);
            c.winograd = winograd;
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status);
            const double wx_u = dot(to_double(gpu.outputs[0]), to_double(c.grad_y));
            const double x_wu = dot(to_double(c.x), to_double(gpu.grad_inputs[0]));
            const double w_ux = dot(to_double(c.weight), to_double(gpu.grad_inputs[1]));
            double scale = 0;  // magnitude of the sums, which may cancel
            for (std::size_t i = 0; i < c.grad_y.size(); ++i)
                scale += std::abs(static_cast<double>(gpu.outputs[0][i]) *
                                  static_cast<double>(c.grad_y[i]));
            EXPECT_NEAR(wx_u, x_wu, 1e-5 * scale) << c.text();
            EXPECT_NEAR(wx_u, w_ux, 1e-5 * scale) << c.text();
        }
}

TEST(Conv2dReference, GradcheckFloat64) {
    std::uint64_t seed = 900;
    for (const ConvShape& shape :
         {ConvShape{1, 1, 1, 1, 1, 3}, ConvShape{2, 3, 4, 5, 2, 3}, ConvShape{2, 3, 2, 2, 4, 1}}) {
        const Conv2dCase c = Conv2dCase::normal(shape, seed += 5);
        const std::vector<double> grad_y = to_double(c.grad_y);
        const auto input = c.reference();
        const auto gradients = ref::conv2d_backward(input, grad_y);
        using Input = ref::Conv2dInput<double>;
        const auto loss = [&](std::vector<double> Input::*member) {
            return [&, member](const std::vector<double>& values) {
                Input changed = input;
                changed.*member = values;
                return dot(ref::conv2d_forward(changed).value, grad_y);
            };
        };
        EXPECT_TRUE(gradcheck("x", loss(&Input::x), input.x, gradients.grad_x.value));
        EXPECT_TRUE(
            gradcheck("weight", loss(&Input::weight), input.weight, gradients.grad_weight.value));
        EXPECT_TRUE(gradcheck("bias", loss(&Input::bias), input.bias, gradients.grad_bias.value));
        EXPECT_TRUE(gradcheck("residual", loss(&Input::residual), input.residual,
                              gradients.grad_residual.value));
    }
}

}  // namespace
}  // namespace splat::test
