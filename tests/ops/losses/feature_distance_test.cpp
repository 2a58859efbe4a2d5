#include "ops/losses/feature_distance.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class FeatureDistance : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(FeatureDistance);

OpCall distance_call(const Shape& shape, std::uint64_t seed) {
    HostTensor weight = normal_tensor({shape[1]}, seed + 2);
    for (float& value : weight.values) value = std::abs(value);
    return sample("feature_distance", Json::object(),
                  {normal_tensor(shape, seed, 0.5), normal_tensor(shape, seed + 1, 0.5), weight},
                  {Shape{shape[0], 1}});
}

TEST_P(FeatureDistance, MatchesFloat64) {
    std::uint64_t seed = 10;
    std::vector<Shape> shapes = {Shape{2, 64, 9, 7}, Shape{1, 130, 5, 5}, Shape{2, 7, 70, 3}};
    for (const Shape& shape : image_shapes())  // single channels are all alike or opposite
        if (shape.rank() == 4 && shape[1] > 1) shapes.push_back(shape);
    ASSERT_GE(shapes.size(), 24U);
    for (const Shape& shape : shapes)
        expect_float64(context(), distance_call(shape, seed += 3), shape.text());
}

/// Where the directions are almost the same, their difference is mostly rounding, which the bound
/// contains.
TEST_P(FeatureDistance, MatchesFloat64NearEqualImages) {
    OpCall call = distance_call({2, 16, 5, 5}, 40);
    call.inputs[1] = call.inputs[0];
    for (std::size_t i = 0; i < call.inputs[1].values.size(); ++i)
        call.inputs[1].values[i] *= i % 3 == 0 ? 1.001F : 1;
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    const OpExpected expected = expected_of(call);
    EXPECT_TRUE(within_bound(gpu.outputs[0], expected.outputs[0],
                             tolerance("feature_distance", "y"), {"y", reproduce("near")}));
    EXPECT_TRUE(within_bound(gpu.grad_inputs[0], expected.grad_inputs[0],
                             tolerance("feature_distance", "grad_a"),
                             {"grad_a", reproduce("near"), true}));
}

TEST_P(FeatureDistance, MatchesFloat64WhereSquaresOverflowOrVanish) {
    for (const float factor : {1e20F, 1e30F, 1e-25F}) {
        OpCall call = distance_call({2, 7, 5, 3}, 45);
        for (float& value : call.inputs[0].values) value *= factor;
        expect_float64(context(), call, "a times " + std::to_string(factor));
    }
}

TEST_P(FeatureDistance, FeaturesOfZerosHaveNoDirection) {
    OpCall call = distance_call({1, 4, 1, 2}, 50);
    call.inputs[0].values = {0, 1, 0, 2, 0, 3, 0, 4};
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(all_finite(gpu.outputs[0], {"y", reproduce("zeros")}));
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(gpu.grad_inputs[0][i] == 0, i % 2 == 0) << i;
}

TEST_P(FeatureDistance, RejectsBadShapes) {
    const auto status = [&](const std::function<void(OpCall&)>& change) {
        OpCall call = distance_call({2, 5, 3, 3}, 60);
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[1] = normal_tensor({2, 5, 9, 1}, 1);
                 }),
                 Code::kShape, "'b'");
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[2] = normal_tensor({6}, 1); }), Code::kShape,
                 "'weight'");
    EXPECT_ERROR(ops::feature_distance_check({1, 4, 1U << 20}), Code::kUnsupported, "1048576");
    EXPECT_ERROR(ops::feature_distance_check({1, 64001, 4}), Code::kUnsupported, "64001 channels");
}

TEST(FeatureDistanceReference, GradcheckFloat64) {
    expect_gradcheck(distance_call({2, 5, 3}, 1));
}

}  // namespace
}  // namespace splat::test
