#include "ops/positional_embedding.h"

#include <gtest/gtest.h>

#include <iterator>

#include "ops/op_harness.h"
#include "ref/positional_embedding_ref.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

class PositionalEmbedding : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(PositionalEmbedding);

OpCall embedding_call(const ref::EmbeddingShape& s, std::uint64_t seed) {
    const auto rows = static_cast<std::uint32_t>(s.rows);
    const auto features = static_cast<std::uint32_t>(s.features);
    const auto dimension = static_cast<std::uint32_t>(s.dimension);
    return sample("positional_embedding", {{"dimension", dimension}, {"swap_halves", s.swap}},
                  {normal_tensor({rows, features}, seed, 0, 3)},
                  {Shape{rows, features * dimension}});
}

/// Rows, features, dimension, halves exchanged.
constexpr ref::EmbeddingShape kEmbeddingShapes[] = {
    {1, 1, 2, false},   {3, 6, 10, false}, {3, 6, 10, true},   {5, 3, 4, true},
    {70, 7, 6, false},  {2, 2, 64, false}, {1, 1, 2, true},    {1, 2, 2, false},
    {2, 1, 8, true},    {1, 3, 16, false}, {7, 5, 2, true},    {8, 8, 8, false},
    {9, 9, 6, true},    {15, 1, 10, true}, {16, 4, 4, false},  {17, 3, 12, true},
    {31, 2, 14, false}, {33, 1, 64, true}, {63, 5, 4, false},  {64, 6, 10, true},
    {65, 7, 2, false},  {1, 129, 2, true}, {257, 1, 4, false}, {2, 65, 6, true},
    {1, 17, 62, false},
};
static_assert(std::size(kEmbeddingShapes) >= 24);

TEST_P(PositionalEmbedding, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const ref::EmbeddingShape& shape : kEmbeddingShapes) {
        const OpCall call = embedding_call(shape, ++seed);
        expect_float64(context(), call, call.attributes.dump());
    }
}

TEST_P(PositionalEmbedding, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("norm", [&](const Golden& golden) {
        OpCall call;
        call.op = "positional_embedding";
        call.attributes = {{"dimension", golden.array("pe.cfg").ints().value().at(0)}};
        call.inputs = {golden_tensor(golden.npz, "pe.x")};
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status);
        EXPECT_TRUE(close(gpu.outputs[0], golden.doubles("pe.y"), kGoldenLayer, kGoldenLayer,
                          {"y", reproduce(golden.name)}));
    });
}

TEST_P(PositionalEmbedding, RejectsBadShapes) {
    const auto status = [&](int dimension, const Shape& x) {
        return run_op(context(), sample("positional_embedding", {{"dimension", dimension}},
                                        {normal_tensor(x, 1)}, std::vector<HostTensor>{}))
            .status;
    };
    EXPECT_OK(status(2, {3, 5}));
    for (const int dimension : {0, -2, 3, 66})
        EXPECT_ERROR(status(dimension, {3, 5}), Code::kInvalidArgument, "dimension");
    EXPECT_ERROR(status(2, {3, 5, 1}), Code::kShape, "'x'");
}

TEST(PositionalEmbeddingReference, GradcheckFloat64) {
    for (const bool swap : {false, true}) expect_gradcheck(embedding_call({2, 3, 4, swap}, 1));
}

}  // namespace
}  // namespace splat::test
