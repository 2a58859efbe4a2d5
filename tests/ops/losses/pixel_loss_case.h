#pragma once

#include "ops/every/op_samples.h"
#include "support/golden_file.h"

/// Shared by the tests of losses of a - b.
namespace splat::test {

struct PixelLoss {
    using Values = std::vector<double>;

    const char* op;
    ref::Summed<double> (*forward)(const Values& a, const Values& b);
    ref::Summed<double> (*backward)(const Values& a, const Values& b, double grad_loss);

    [[nodiscard]] OpCall call(const HostTensor& a, const HostTensor& b, float grad_loss) const {
        return sample(op, Json::object(), {a, b}, std::vector<HostTensor>{{{1}, {grad_loss}}});
    }
};

/// One element, ends of chunks, channels that pad a quad, batches.
inline void expect_float64(vk::Context& context, const PixelLoss& loss) {
    std::uint64_t seed = 10;
    std::vector<Shape> shapes = image_shapes();
    for (const Shape& shape :
         {Shape{1, 1}, Shape{1, 3, 32, 32}, Shape{4, 7, 17, 31}, Shape{4, 3, 128, 128}})
        shapes.push_back(shape);
    for (const Shape& shape : shapes) {
        seed += 2;
        const OpCall call =
            loss.call(normal_tensor(shape, seed), normal_tensor(shape, seed + 1, 0.3), 1.5F);
        const std::vector<double> a = to_double(call.inputs[0].values);
        const std::vector<double> b = to_double(call.inputs[1].values);
        expect_matches(context, call, {loss.forward(a, b)}, {loss.backward(a, b, 1.5), {}},
                       shape.text());
    }
}

inline void expect_zero_of_equals(vk::Context& context, const PixelLoss& loss) {
    const HostTensor a = normal_tensor({2, 3, 4, 5}, 40);
    const OpResult gpu = run_op(context, loss.call(a, a, 2));
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0][0], 0);
    for (const float gradient : gpu.grad_inputs[0]) EXPECT_EQ(gradient, 0);
}

inline void expect_golden(vk::Context& context, const PixelLoss& loss) {
    each_golden("metric", [&](const Golden& golden) {
        const std::vector<std::string> pairs = golden.cases("a");
        golden.expect_cases(pairs, {"0", "1", "2"});
        for (const std::string& pair : pairs) {
            const auto tensor = [&](const char* key) {
                return image_batch(golden_tensor(golden.npz, pair + "." + key));
            };
            const std::string op = loss.op;
            const OpResult gpu = run_op(context, loss.call(tensor("a"), tensor("b"), 1));
            ASSERT_OK(gpu.status);
            const std::string how = reproduce(golden.name);
            EXPECT_TRUE(close(gpu.outputs[0], golden.doubles(pair + "." + op + "64"), 0,
                              kGoldenLayer, {"loss", how}));
            EXPECT_TRUE(close(gpu.grad_inputs[0], golden.doubles(pair + ".d_" + op + "64"), 1e-10,
                              kGoldenLayer, {"grad_a", how, true}));
        }
    });
}

inline void expect_refusals(vk::Context& context, const PixelLoss& loss) {
    const auto status = [&](const Shape& a, const Shape& b) {
        return run_op(context, loss.call(normal_tensor(a, 1), normal_tensor(b, 2), 1)).status;
    };
    EXPECT_ERROR(status({2, 3, 4}, {2, 4, 3}), Code::kShape, "'b'");
    EXPECT_ERROR(status({6}, {6}), Code::kShape, "channels");
}

/// The reference's gradient is that of its own values.
inline void expect_gradcheck_of(const PixelLoss& loss) {
    const std::vector<double> a = to_double(normal_fill(40, 1));
    const std::vector<double> b = to_double(normal_fill(40, 2));
    expect_gradcheck({a, b},
                     [&](const Arrays& in) { return Arrays{loss.forward(in[0], in[1]).value}; },
                     {{1.5}}, {loss.backward(a, b, 1.5).value, {}});
}

}  // namespace splat::test
