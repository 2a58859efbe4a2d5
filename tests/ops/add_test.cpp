#include "ops/add.h"

#include <gtest/gtest.h>

#include "ops/every/op_samples.h"
#include "ref/add_ref.h"

namespace splat::test {
namespace {

class Add : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Add);

OpCall add_call(const Shape& shape, double scale, std::uint64_t seed) {
    return sample("add", {{"scale", scale}},
                  {normal_tensor(shape, seed), normal_tensor(shape, seed + 1)}, {shape});
}

TEST_P(Add, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const Shape& shape : image_shapes()) {
        const OpCall call = add_call(shape, seed % 2 == 0 ? 1 : 0.70710678, seed);
        seed += 3;
        const auto scale =
            static_cast<double>(static_cast<float>(call.attributes["scale"].get<double>()));
        const auto grad = ref::add_backward(scale, to_double(call.grad_outputs[0].values));
        expect_matches(context(), call,
                       {ref::add_forward(scale, to_double(call.inputs[0].values),
                                         to_double(call.inputs[1].values))},
                       {grad, grad}, shape.text());
    }
}

TEST_P(Add, IntegersAreExact) {
    std::uint64_t seed = 300;
    for (const Shape& shape : image_shapes()) {
        OpCall call = add_call(shape, 0.5, seed);
        for (auto* tensors : {&call.inputs, &call.grad_outputs})
            for (HostTensor& tensor : *tensors)
                tensor.values = integer_fill(shape.elements(), ++seed);
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status) << shape.text();
        const std::string how = reproduce(shape.text());
        const bool tiny = shape.elements() < 10;  // a ninth of the integers is 0
        const auto grad = ref::add_backward(0.5, to_double(call.grad_outputs[0].values));
        EXPECT_TRUE(exact(gpu.outputs[0],
                          ref::add_forward(0.5, to_double(call.inputs[0].values),
                                           to_double(call.inputs[1].values)),
                          {"y", how, false, tiny}));
        EXPECT_TRUE(exact(gpu.grad_inputs[0], grad, {"grad_a", how, true, tiny}));
        EXPECT_TRUE(exact(gpu.grad_inputs[1], grad, {"grad_b", how, true, tiny}));
    }
}

TEST_P(Add, RejectsBadShapes) {
    OpCall call = add_call({2, 3, 4}, 1, 50);
    call.inputs[1] = normal_tensor({2, 4, 3}, 1);
    EXPECT_ERROR(run_op(context(), call).status, Code::kShape, "'b'");
    EXPECT_ERROR(run_op(context(), add_call({6}, 1, 50)).status, Code::kShape, "channels");
}

TEST(AddReference, GradcheckFloat64) {
    const Arrays inputs = {to_double(normal_fill(12, 1)), to_double(normal_fill(12, 2))};
    const std::vector<double> grad_y = to_double(normal_fill(12, 3));
    const auto grad = ref::add_backward(0.3, grad_y).value;
    expect_gradcheck(
        inputs, [](const Arrays& in) { return Arrays{ref::add_forward(0.3, in[0], in[1]).value}; },
        {grad_y}, {grad, grad});
}

}  // namespace
}  // namespace splat::test
