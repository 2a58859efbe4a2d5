#include "ops/add.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

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
        expect_float64(context(), add_call(shape, seed % 2 == 0 ? 1 : 0.70710678, seed),
                       shape.text());
        seed += 3;
    }
}

TEST_P(Add, IntegersAreExact) {
    std::uint64_t seed = 300;
    for (const Shape& shape : image_shapes()) {
        // A ninth of the integers is 0.
        expect_exact(context(), with_integers(add_call(shape, 0.5, seed), seed), shape.text(),
                     shape.elements() < 10);
        seed += 3;
    }
}

TEST_P(Add, RejectsBadShapes) {
    OpCall call = add_call({2, 3, 4}, 1, 50);
    call.inputs[1] = normal_tensor({2, 4, 3}, 1);
    EXPECT_ERROR(run_op(context(), call).status, Code::kShape, "'b'");
    EXPECT_ERROR(run_op(context(), add_call({6}, 1, 50)).status, Code::kShape, "channels");
}

TEST(AddReference, GradcheckFloat64) {
    expect_gradcheck(add_call({2, 3, 2}, 0.3, 1));
}

}  // namespace
}  // namespace splat::test
