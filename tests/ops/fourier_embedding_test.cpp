#include "ops/fourier_embedding.h"

#include <gtest/gtest.h>

#include <iterator>

#include "ops/op_harness.h"
#include "ref/fourier_embedding_ref.h"

namespace splat::test {
namespace {

class FourierEmbedding : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(FourierEmbedding);

/// Frequencies as Song et al. draw them; `spread` is that of x.
OpCall fourier_call(const ref::FourierShape& s, std::uint64_t seed, double spread = 3) {
    const auto rows = static_cast<std::uint32_t>(s.rows);
    const auto features = static_cast<std::uint32_t>(s.features);
    const auto waves = static_cast<std::uint32_t>(s.waves);
    return sample(
        "fourier_embedding", Json::object(),
        {normal_tensor({rows, features}, seed, 0, spread), normal_tensor({waves}, seed + 1, 0, 16)},
        {Shape{rows, features * 2 * waves}});
}

void expect_fourier(vk::Context& context, const ref::FourierShape& shape, const OpCall& call) {
    expect_float64(context, call,
                   call.inputs[0].shape.text() + " waves " + std::to_string(shape.waves));
}

/// Rows, features, frequencies.
constexpr ref::FourierShape kFourierShapes[] = {
    {1, 1, 1},   {1, 1, 2},   {1, 2, 3},   {2, 3, 5},   {3, 1, 7},   {1, 5, 8},   {2, 7, 9},
    {7, 8, 1},   {8, 4, 4},   {9, 1, 15},  {15, 3, 2},  {16, 2, 16}, {17, 1, 17}, {31, 6, 1},
    {33, 1, 3},  {63, 2, 2},  {64, 4, 8},  {65, 1, 5},  {1, 17, 31}, {1, 65, 1},  {2, 1, 129},
    {127, 3, 1}, {129, 1, 2}, {257, 1, 1}, {1, 1, 128}, {3, 2, 64},
};
static_assert(std::size(kFourierShapes) >= 24);

TEST_P(FourierEmbedding, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const ref::FourierShape& shape : kFourierShapes)
        expect_fourier(context(), shape, fourier_call(shape, seed += 2));
}

/// Thousands and millions of turns, where rounding the product would be off by whole turns; and no
/// turn at all.
TEST_P(FourierEmbedding, IsAsRightAfterMillionsOfTurns) {
    const ref::FourierShape shape{20, 3, 8};
    std::uint64_t seed = 100;
    for (const double spread : {1e-6, 1e3, 1e6, 1e9})
        expect_fourier(context(), shape, fourier_call(shape, seed += 2, spread));
}

TEST_P(FourierEmbedding, WholeAndQuarterTurnsAreExact) {
    OpCall call = fourier_call({1, 4, 1}, 200);
    call.inputs[0].values = {3, -0.25F, 1e6F, 0.5F};
    call.inputs[1].values = {1};
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0], (std::vector<float>{1, 0, 0, -1, 1, 0, -1, 0}));
}

TEST_P(FourierEmbedding, RejectsBadShapes) {
    const auto status = [&](const Shape& x, const Shape& frequencies) {
        return run_op(context(), sample("fourier_embedding", Json::object(),
                                        {normal_tensor(x, 1), normal_tensor(frequencies, 2)},
                                        std::vector<HostTensor>{}))
            .status;
    };
    EXPECT_OK(status({3, 5}, {4}));
    EXPECT_ERROR(status({3, 5, 1}, {4}), Code::kShape, "'x'");
    EXPECT_ERROR(status({3, 5}, {4, 1}), Code::kShape, "'frequencies'");
}

TEST(FourierEmbeddingReference, GradcheckFloat64) {
    OpCall call = fourier_call({2, 3, 4}, 1, 1);
    call.inputs[1] = normal_tensor({4}, 2, 0, 2);
    expect_gradcheck(call);
}

TEST(FourierEmbeddingCheck, RefusesResultsBeyond31Bits) {
    EXPECT_OK(ops::fourier_embedding_check({1U << 15, 1U << 7, 1U << 7}));
    EXPECT_ERROR(ops::fourier_embedding_check({1U << 16, 1U << 7, 1U << 7}), Code::kUnsupported,
                 "2^31");
    EXPECT_ERROR(ops::fourier_embedding_check({~0U, ~0U, ~0U}), Code::kUnsupported, "2^31");
    EXPECT_OK(ops::fourier_embedding_check({1, 4, 16000}));
    EXPECT_ERROR(ops::fourier_embedding_check({1, 4, 16001}), Code::kUnsupported, "16001");
}

}  // namespace
}  // namespace splat::test
