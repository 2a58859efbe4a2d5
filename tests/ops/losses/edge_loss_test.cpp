#include "ops/losses/edge_loss.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class EdgeLoss : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(EdgeLoss);

OpCall edge_call(const HostTensor& a, const HostTensor& b, const HostTensor& weight, bool scharr,
                 float grad_loss) {
    return sample("edge_loss", {{"scharr", scharr}}, {a, b, weight},
                  std::vector<HostTensor>{{{1}, {grad_loss}}});
}

/// Lines and images so small that both taps are reflected, ends of chunks, channels that pad a quad, batches.
constexpr std::uint32_t kEdgeShapes[][4] = {
    {1, 1, 1, 3},  {1, 2, 3, 1}, {2, 3, 2, 3},   {1, 3, 1, 65},  {1, 5, 65, 1},   {1, 4, 3, 3},
    {2, 3, 9, 13}, {3, 7, 8, 6}, {1, 3, 37, 41}, {1, 1, 64, 65}, {2, 3, 128, 33},
};

TEST_P(EdgeLoss, MatchesFloat64) {
    std::uint64_t seed = 70;
    for (const auto& [n, c, h, w] : kEdgeShapes)
        for (const bool scharr : {false, true})
            for (const bool weighted : {false, true}) {
                const Shape shape{n, c, h, w};
                seed += 3;
                const HostTensor weight =
                    weighted ? normal_tensor({n, 1, h, w}, seed + 2, 1) : HostTensor{};
                const OpCall call = edge_call(normal_tensor(shape, seed),
                                              normal_tensor(shape, seed + 1), weight, scharr, 1.5F);
                expect_float64(context(), call, shape.text());
            }
}

/// A ramp of 1 per pixel along each axis, inside its border, where the reflection makes the slope 0.
TEST_P(EdgeLoss, OfARampIsItsSlope) {
    constexpr std::uint32_t kSide = 12;
    HostTensor a{{1, 1, kSide, kSide}, {}};
    const HostTensor b{{1, 1, kSide, kSide}, std::vector<float>(kSide * kSide, 7.0F)};
    for (std::uint32_t i = 0; i < kSide * kSide; ++i)
        a.values.push_back(3.0F * static_cast<float>(i % kSide) -
                           2.0F * static_cast<float>(i / kSide));
    const double inside = static_cast<double>(kSide - 2) / kSide;
    for (const bool scharr : {false, true}) {
        const OpResult gpu = run_op(context(), edge_call(a, b, {}, scharr, 1));
        ASSERT_OK(gpu.status);
        EXPECT_NEAR(gpu.outputs[0][0], 5 * inside, 1e-5);
    }
}

TEST_P(EdgeLoss, ImagesThatDifferByAConstantGiveZero) {
    HostTensor a = normal_tensor({2, 3, 5, 6}, 40);
    for (float& value : a.values) value = std::round(64 * value) / 64;  // so that + 1 is exact
    HostTensor b = a;
    for (float& value : b.values) value += 1;
    const OpResult gpu = run_op(context(), edge_call(a, b, {}, false, 1));
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0][0], 0);
    for (const float gradient : gpu.grad_inputs[0]) EXPECT_EQ(gradient, 0);
}

/// Both neighbours of a pixel are one, or itself.
TEST_P(EdgeLoss, OfTwoPixelsIsZero) {
    for (const Shape& shape : {Shape{1, 3, 2, 2}, Shape{2, 1, 1, 2}, Shape{1, 1, 1, 1}}) {
        const OpResult gpu = run_op(
            context(), edge_call(normal_tensor(shape, 50), normal_tensor(shape, 51), {}, true, 1));
        ASSERT_OK(gpu.status);
        EXPECT_EQ(gpu.outputs[0][0], 0);
        for (const float gradient : gpu.grad_inputs[0]) EXPECT_EQ(gradient, 0);
    }
}

TEST_P(EdgeLoss, RejectsBadShapes) {
    const auto status = [this](const Shape& a, const Shape& b, const Shape& weight) {
        return run_op(context(),
                      edge_call(normal_tensor(a, 1), normal_tensor(b, 2),
                                weight.rank() == 0 ? HostTensor{} : normal_tensor(weight, 3), false,
                                1))
            .status;
    };
    EXPECT_ERROR(status({1, 3, 4, 5}, {1, 3, 5, 4}, {}), Code::kShape, "'b'");
    EXPECT_ERROR(status({1, 3, 20}, {1, 3, 20}, {}), Code::kShape, "[N, C, H, W]");
    EXPECT_ERROR(status({2, 3, 4, 5}, {2, 3, 4, 5}, {2, 3, 4, 5}), Code::kShape, "'weight'");
}

TEST(EdgeLossReference, GradcheckFloat64) {
    for (const Shape& shape : {Shape{1, 2, 4, 5}, Shape{2, 1, 1, 3}, Shape{1, 1, 2, 2}})
        for (const bool scharr : {false, true}) {
            const HostTensor weight = normal_tensor({shape[0], 1, shape[2], shape[3]}, 62, 1);
            expect_gradcheck(edge_call(normal_tensor(shape, 60), normal_tensor(shape, 61), weight,
                                       scharr, 1.5F));
        }
}

}  // namespace
}  // namespace splat::test
