#include "ops/losses/feature_distance.h"

#include <gtest/gtest.h>

#include "ops/every/op_samples.h"
#include "ref/losses/feature_distance_ref.h"

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

ref::FeatureShape feature_shape(const Shape& shape) {
    return {shape[0], shape[1], shape.elements() / shape[0] / shape[1]};
}

void expect_distance(vk::Context& context, const OpCall& call, const std::string& what) {
    const ref::FeatureShape shape = feature_shape(call.inputs[0].shape);
    const std::vector<double> a = to_double(call.inputs[0].values);
    const std::vector<double> b = to_double(call.inputs[1].values);
    const std::vector<double> w = to_double(call.inputs[2].values);
    expect_matches(
        context, call, {ref::feature_distance_forward(shape, a, b, w)},
        {ref::feature_distance_backward(shape, a, b, w, to_double(call.grad_outputs[0].values))},
        what);
}

TEST_P(FeatureDistance, MatchesFloat64) {
    std::uint64_t seed = 10;
    std::vector<Shape> shapes = {Shape{2, 64, 9, 7}, Shape{1, 130, 5, 5}, Shape{2, 7, 70, 3}};
    for (const Shape& shape : image_shapes())  // single channels are all alike or opposite
        if (shape.rank() == 4 && shape[1] > 1) shapes.push_back(shape);
    ASSERT_GE(shapes.size(), 24U);
    for (const Shape& shape : shapes)
        expect_distance(context(), distance_call(shape, seed += 3), shape.text());
}

/// Where the directions are almost the same, their difference is mostly rounding, which the bound
/// contains.
TEST_P(FeatureDistance, MatchesFloat64NearEqualImages) {
    OpCall call = distance_call({2, 16, 5, 5}, 40);
    call.inputs[1] = call.inputs[0];
    for (std::size_t i = 0; i < call.inputs[1].values.size(); ++i)
        call.inputs[1].values[i] *= i % 3 == 0 ? 1.001F : 1;
    const ref::FeatureShape shape = feature_shape(call.inputs[0].shape);
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    const auto inputs = [&](std::size_t i) { return to_double(call.inputs[i].values); };
    EXPECT_TRUE(within_bound(gpu.outputs[0],
                             ref::feature_distance_forward(shape, inputs(0), inputs(1), inputs(2)),
                             tolerance("feature_distance", "y"), {"y", reproduce("near")}));
    EXPECT_TRUE(within_bound(gpu.grad_inputs[0],
                             ref::feature_distance_backward(shape, inputs(0), inputs(1), inputs(2),
                                                            to_double(call.grad_outputs[0].values)),
                             tolerance("feature_distance", "grad_a"),
                             {"grad_a", reproduce("near"), true}));
}

TEST_P(FeatureDistance, MatchesFloat64WhereSquaresOverflowOrVanish) {
    for (const float factor : {1e20F, 1e30F, 1e-25F}) {
        OpCall call = distance_call({2, 7, 5, 3}, 45);
        for (float& value : call.inputs[0].values) value *= factor;
        expect_distance(context(), call, "a times " + std::to_string(factor));
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
    const ref::FeatureShape shape{2, 5, 3};
    const std::vector<double> a = to_double(normal_fill(30, 1, 0.5));
    const std::vector<double> b = to_double(normal_fill(30, 2, 0.5));
    const std::vector<double> w = to_double(normal_fill(5, 3));
    const std::vector<double> grad_y = to_double(normal_fill(2, 4));
    expect_gradcheck({a},
                     [&](const Arrays& in) {
                         return Arrays{ref::feature_distance_forward(shape, in[0], b, w).value};
                     },
                     {grad_y}, {ref::feature_distance_backward(shape, a, b, w, grad_y).value});
}

}  // namespace
}  // namespace splat::test
