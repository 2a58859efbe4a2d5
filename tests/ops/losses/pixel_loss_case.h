#pragma once

#include "ops/op_harness.h"
#include "support/golden_file.h"

/// Shared by the tests of losses of a - b.
namespace splat::test {

inline OpCall loss_call(const char* op, const HostTensor& a, const HostTensor& b, float grad_loss) {
    return sample(op, Json::object(), {a, b}, std::vector<HostTensor>{{{1}, {grad_loss}}});
}

/// One element, ends of chunks, channels that pad a quad, batches.
inline void expect_loss(vk::Context& context, const char* op) {
    std::uint64_t seed = 10;
    std::vector<Shape> shapes = image_shapes();
    for (const Shape& shape :
         {Shape{1, 1}, Shape{1, 3, 32, 32}, Shape{4, 7, 17, 31}, Shape{4, 3, 128, 128}})
        shapes.push_back(shape);
    for (const Shape& shape : shapes) {
        seed += 2;
        expect_float64(
            context,
            loss_call(op, normal_tensor(shape, seed), normal_tensor(shape, seed + 1, 0.3), 1.5F),
            shape.text());
    }
}

inline void expect_zero_of_equals(vk::Context& context, const char* op) {
    const HostTensor a = normal_tensor({2, 3, 4, 5}, 40);
    const OpResult gpu = run_op(context, loss_call(op, a, a, 2));
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0][0], 0);
    for (const float gradient : gpu.grad_inputs[0]) EXPECT_EQ(gradient, 0);
}

inline void expect_golden(vk::Context& context, const char* op) {
    each_golden("metric", [&](const Golden& golden) {
        const std::vector<std::string> pairs = golden.cases("a");
        golden.expect_cases(pairs, {"0", "1", "2"});
        for (const std::string& pair : pairs) {
            const auto tensor = [&](const char* key) {
                return image_batch(golden_tensor(golden.npz, pair + "." + key));
            };
            const OpResult gpu = run_op(context, loss_call(op, tensor("a"), tensor("b"), 1));
            ASSERT_OK(gpu.status);
            const std::string how = reproduce(golden.name);
            EXPECT_TRUE(close(gpu.outputs[0], golden.doubles(pair + "." + op + "64"), 0,
                              kGoldenLayer, {"loss", how}));
            EXPECT_TRUE(close(gpu.grad_inputs[0], golden.doubles(pair + ".d_" + op + "64"), 1e-10,
                              kGoldenLayer, {"grad_a", how, true}));
        }
    });
}

inline void expect_refusals(vk::Context& context, const char* op) {
    const auto status = [&](const Shape& a, const Shape& b) {
        return run_op(context, loss_call(op, normal_tensor(a, 1), normal_tensor(b, 2), 1)).status;
    };
    EXPECT_ERROR(status({2, 3, 4}, {2, 4, 3}), Code::kShape, "'b'");
    EXPECT_ERROR(status({6}, {6}), Code::kShape, "channels");
}

/// The reference's gradient is that of its own values.
inline void expect_gradcheck_of(const char* op) {
    expect_gradcheck(loss_call(op, normal_tensor({10, 4}, 1), normal_tensor({10, 4}, 2), 1.5F));
}

}  // namespace splat::test
