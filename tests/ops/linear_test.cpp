#include "ops/linear.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ops/op_harness.h"
#include "ref/linear_ref.h"
#include "support/gpu_buffers.h"
#include "support/gradcheck.h"
#include "support/rng_fill.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

/// Inputs of one linear call, for the device and for the reference.
struct LinearCase {
    MatrixShape shape;
    std::vector<float> x;
    std::vector<float> weight;
    std::vector<float> bias;
    std::vector<float> grad_y;

    static LinearCase normal(const MatrixShape& s, bool bias, std::uint64_t seed) {
        return {s, normal_fill(std::size_t{s.rows} * s.in, seed),
                normal_fill(std::size_t{s.out} * s.in, seed + 1),
                normal_fill(bias ? s.out : 0, seed + 2),
                normal_fill(std::size_t{s.rows} * s.out, seed + 3)};
    }
    static LinearCase integers(const MatrixShape& s, std::uint64_t seed) {
        return {s, integer_fill(std::size_t{s.rows} * s.in, seed),
                integer_fill(std::size_t{s.out} * s.in, seed + 1), integer_fill(s.out, seed + 2),
                integer_fill(std::size_t{s.rows} * s.out, seed + 3)};
    }

    [[nodiscard]] OpCall call() const {
        OpCall call;
        call.op = "linear";
        call.inputs = {{{shape.rows, shape.in}, x},
                       {{shape.out, shape.in}, weight},
                       {bias.empty() ? Shape{} : Shape{shape.out}, bias}};
        call.grad_outputs = {{{shape.rows, shape.out}, grad_y}};
        return call;
    }
    [[nodiscard]] ref::LinearInput<double> reference() const {
        return {
            {shape.rows, shape.in, shape.out}, to_double(x), to_double(weight), to_double(bias)};
    }
    [[nodiscard]] std::string text() const {
        return shape.text() + (bias.empty() ? " no bias" : "");
    }
};

class Linear : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Linear);

void expect_matches(vk::Context& context, const LinearCase& c) {
    const OpResult gpu = run_op(context, c.call());
    ASSERT_OK(gpu.status) << c.text();
    const auto y = ref::linear_forward(c.reference());
    const auto gradients = ref::linear_backward(c.reference(), to_double(c.grad_y));
    const std::string how = reproduce(c.text());
    EXPECT_TRUE(matches(gpu.outputs[0], y, tolerance("linear", "y"), {"y", how}));
    EXPECT_TRUE(matches(gpu.grad_inputs[0], gradients.grad_x, tolerance("linear", "grad_x"),
                        {"grad_x", how, true}));
    EXPECT_TRUE(matches(gpu.grad_inputs[1], gradients.grad_weight,
                        tolerance("linear", "grad_weight"), {"grad_weight", how, true}));
    if (c.bias.empty()) {
        EXPECT_TRUE(gpu.grad_inputs[2].empty());
        return;
    }
    EXPECT_TRUE(matches(gpu.grad_inputs[2], gradients.grad_bias, tolerance("linear", "grad_bias"),
                        {"grad_bias", how, true}));
}

TEST_P(Linear, ForwardMatchesFloat64) {
    std::uint64_t seed = 100;
    for (const MatrixShape& shape : kMatrixShapes) {
        ++seed;
        const LinearCase c = LinearCase::normal(shape, seed % 3 != 0, seed);
        OpCall call = c.call();
        call.grad_outputs.clear();
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status) << c.text();
        EXPECT_TRUE(matches(gpu.outputs[0], ref::linear_forward(c.reference()),
                            tolerance("linear", "y"), {"y", reproduce(c.text())}));
    }
}

TEST_P(Linear, BackwardMatchesFloat64) {
    std::uint64_t seed = 200;
    for (const MatrixShape& shape : kMatrixBackwardShapes) {
        expect_matches(context(), LinearCase::normal(shape, true, ++seed));
        if (HasFailure()) return;
    }
    expect_matches(context(), LinearCase::normal({17, 15, 31}, false, 250));
}

TEST_P(Linear, IntegersAreExact) {
    std::uint64_t seed = 300;
    for (const MatrixShape& shape : kMatrixShapes) {  // sums stay below 2^24
        const LinearCase c = LinearCase::integers(shape, ++seed);
        const OpResult gpu = run_op(context(), c.call());
        ASSERT_OK(gpu.status) << c.text();
        const auto gradients = ref::linear_backward(c.reference(), to_double(c.grad_y));
        const std::string how = reproduce(c.text());
        const bool tiny = shape.rows * shape.out < 10;  // a ninth of the integers is 0
        EXPECT_TRUE(
            exact(gpu.outputs[0], ref::linear_forward(c.reference()), {"y", how, false, tiny}));
        EXPECT_TRUE(exact(gpu.grad_inputs[0], gradients.grad_x, {"grad_x", how, true, tiny}));
        EXPECT_TRUE(
            exact(gpu.grad_inputs[1], gradients.grad_weight, {"grad_weight", how, true, tiny}));
        EXPECT_TRUE(exact(gpu.grad_inputs[2], gradients.grad_bias, {"grad_bias", how, true, tiny}));
    }
}

TEST_P(Linear, AdjointIdentity) {
    std::uint64_t seed = 400;
    for (const MatrixShape& shape : kMatrixBackwardShapes) {
        const LinearCase c = LinearCase::normal(shape, false, ++seed);
        const OpResult gpu = run_op(context(), c.call());
        ASSERT_OK(gpu.status);
        const double wx_u = dot(to_double(gpu.outputs[0]), to_double(c.grad_y));
        const double x_wu = dot(to_double(c.x), to_double(gpu.grad_inputs[0]));
        const double w_ux = dot(to_double(c.weight), to_double(gpu.grad_inputs[1]));
        double scale = 0;  // magnitude of the sums, which may cancel
        for (std::size_t i = 0; i < c.grad_y.size(); ++i)
            scale +=
                std::abs(static_cast<double>(gpu.outputs[0][i]) * static_cast<double>(c.grad_y[i]));
        EXPECT_NEAR(wx_u, x_wu, 1e-5 * scale) << c.text();
        EXPECT_NEAR(wx_u, w_ux, 1e-5 * scale) << c.text();
    }
}

TEST_P(Linear, LongSumsStayAccurate) {
    expect_matches(context(), LinearCase::normal({3, 9216, 5}, true, 500));
    // grad_weight over 8 images of 128 x 128: a plain sequential loop costs two digits, and
    // lavapipe silently leaves any loop after 65535 turns, nested ones counted together.
    expect_matches(context(), LinearCase::normal({131072, 3, 5}, true, 510));
    expect_matches(context(), LinearCase::normal({1048576, 2, 3}, true, 520));
}

TEST_P(Linear, CancellationStaysWithinTheBound) {
    LinearCase c = LinearCase::normal({9, 1024, 33}, true, 530);
    for (std::size_t i = 0; i < c.x.size(); ++i)  // +1e4 and -1e4 alternately
        c.x[i] += i % 2 == 0 ? 1e4F : -1e4F;
    for (std::size_t i = 1; i < c.weight.size(); i += 2) c.weight[i] = c.weight[i - 1];
    expect_matches(context(), c);
}

TEST_P(Linear, RejectsBadShapes) {
    const LinearCase good = LinearCase::normal({3, 5, 7}, true, 620);
    const auto status = [&](const auto& change) {
        OpCall call = good.call();
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[1].shape = {5, 7}; }), Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[1].shape = {35}; }), Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[0].shape = {3, 5, 1}; }), Code::kShape, "'x'");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[2] = {{6}, std::vector<float>(6)};
                 }),
                 Code::kShape, "bias");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["bias"] = true; }), Code::kInvalidArgument,
                 "bias");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.grad_outputs[0].shape = {7, 3};
                 }),
                 Code::kShape, "grad_y");
}

TEST(LinearReference, GradcheckFloat64) {
    std::uint64_t seed = 700;
    for (const MatrixShape& shape :
         {MatrixShape{1, 1, 1}, MatrixShape{3, 5, 7}, MatrixShape{8, 4, 2}}) {
        const LinearCase c = LinearCase::normal(shape, true, ++seed);
        const std::vector<double> grad_y = to_double(c.grad_y);
        const auto input = c.reference();
        const auto gradients = ref::linear_backward(input, grad_y);
        using Input = ref::LinearInput<double>;
        const auto loss = [&](std::vector<double> Input::*member) {
            return [&, member](const std::vector<double>& values) {
                Input changed = input;
                changed.*member = values;
                return dot(ref::linear_forward(changed).value, grad_y);
            };
        };
        EXPECT_TRUE(gradcheck("x", loss(&Input::x), input.x, gradients.grad_x.value));
        EXPECT_TRUE(
            gradcheck("weight", loss(&Input::weight), input.weight, gradients.grad_weight.value));
        EXPECT_TRUE(gradcheck("bias", loss(&Input::bias), input.bias, gradients.grad_bias.value));
    }
}

TEST(LinearCheck, RefusesProductsBeyond31Bits) {
    EXPECT_OK(ops::linear_check({1U << 15, 1U << 15, 16, true}));
    EXPECT_ERROR(ops::linear_check({1U << 16, 1U << 16, 1, true}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::linear_check({1U << 16, 1, 1U << 16, true}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::linear_check({1, 1U << 16, 1U << 16, true}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::linear_check({~0U, ~0U, ~0U, true}), Code::kUnsupported, "2^31");
}

}  // namespace
}  // namespace splat::test
