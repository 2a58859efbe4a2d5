#include "ops/split3.h"

#include <gtest/gtest.h>

#include "ops/every/op_samples.h"
#include "ref/split3_ref.h"

namespace splat::test {
namespace {

class Split3 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Split3);

TEST_P(Split3, MovesEveryElement) {
    std::uint64_t seed = 10;
    std::vector<Shape> parts_to_test;
    for (const Shape& shape : image_shapes())
        parts_to_test.push_back(
            {shape[0], shape[1],
             static_cast<std::uint32_t>(shape.elements() / (std::uint64_t{shape[0]} * shape[1]))});
    for (const Shape& part : parts_to_test) {
        const OpCall call =
            sample("split3", Json::object(),
                   {normal_tensor({part[0], 3 * part[1], part[2]}, ++seed)}, {part, part, part});
        const auto parts = ref::split3_forward(part[2], to_double(call.inputs[0].values));
        const auto grad =
            ref::split3_backward<double>(part[2], {to_double(call.grad_outputs[0].values),
                                                   to_double(call.grad_outputs[1].values),
                                                   to_double(call.grad_outputs[2].values)});
        expect_matches(context(), call, {parts[0], parts[1], parts[2]}, {grad}, part.text());
    }
}

TEST_P(Split3, RejectsBadShapes) {
    const Shape part{1, 2, 2};
    for (const std::uint32_t channels : {2U, 4U, 7U})
        EXPECT_ERROR(
            run_op(context(), sample("split3", Json::object(), {normal_tensor({1, channels, 2}, 1)},
                                     {part, part, part}))
                .status,
            Code::kShape, "multiple of 3");
}

TEST(Split3Reference, GradcheckFloat64) {
    const std::vector<double> x = to_double(normal_fill(2 * 9 * 4, 1));
    Arrays grads;
    for (std::uint64_t j = 0; j < 3; ++j) grads.push_back(to_double(normal_fill(24, 2 + j)));
    expect_gradcheck({x},
                     [](const Arrays& in) {
                         const auto parts = ref::split3_forward(4, in[0]);
                         return Arrays{parts[0].value, parts[1].value, parts[2].value};
                     },
                     grads,
                     {ref::split3_backward<double>(4, {grads[0], grads[1], grads[2]}).value});
}

}  // namespace
}  // namespace splat::test
