#include "nn/graph.h"

#include <gtest/gtest.h>

#include "nn/parameters.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"

namespace splat::test {
namespace {

using nn::Graph;
using nn::ValueId;
using ops::Layout;

class GraphRules : public testing::Test {
  protected:
    void SetUp() override {
        context_ = shared_context();
        ASSERT_NE(context_, nullptr);
    }
    vk::Context* context_ = nullptr;
};

TEST_F(GraphRules, TheFirstErrorSticks) {
    Graph graph(*context_);
    const ValueId x = graph.input("x", {3, 8});
    const ValueId w = graph.parameter("w", {5, 7});
    const ValueId y = graph.op("linear", {x, w});
    EXPECT_EQ(y, nn::kNoValue);
    EXPECT_EQ(graph.op("group_norm", {y, w, w}), nn::kNoValue);
    EXPECT_ERROR(graph.status(), Code::kShape, "linear: tensor 'weight' has shape [5, 7]");
}

TEST_F(GraphRules, RefusesWhatRowsDoNotTake) {
    struct Case {
        const char* part;
        void (*build)(Graph&);
    };
    const Case cases[] = {
        {"no operator named 'convolve'",
         [](Graph& g) {
             g.op("convolve", {g.input("x", {1, 4})});
         }},
        {"no attribute 'grups'",
         [](Graph& g) {
             const ValueId p = g.parameter("p", {4});
             g.op("group_norm", {g.input("x", {1, 4}), p, p}, {{"grups", std::int64_t{2}}});
         }},
        {"linear: tensor 'weight' is absent",
         [](Graph& g) {
             g.op("linear", {g.input("x", {1, 4})});
         }},
        {"linear: tensor 'x' is row-major, expected an activation",
         [](Graph& g) {
             g.op("linear", {g.input("x", {1, 4}, Layout::kRowMajor), g.parameter("w", {4, 4})});
         }},
        {"two parameters named 'w'",
         [](Graph& g) {
             g.parameter("w", {4});
             g.parameter("w", {4});
         }},
        {"does not fit [2, 3, 4]",
         [](Graph& g) {
             g.reshape(g.input("x", {2, 4, 3}), {2, 3, 4});
         }},
    };
    for (const Case& c : cases) {
        Graph graph(*context_);
        c.build(graph);
        ASSERT_FALSE(graph.status().ok()) << c.part;
        EXPECT_NE(graph.status().message().find(c.part), std::string::npos)
            << graph.status().message();
    }
}

TEST_F(GraphRules, ReshapesShareMemory) {
    Graph graph(*context_);
    const ValueId x = graph.input("x", {4, 8, 3, 5});
    const ValueId wide = graph.reshape(x, {2, 8, 6, 5});
    const ValueId back = graph.reshape(wide, {4, 8, 15});
    ASSERT_OK(graph.status());
    EXPECT_EQ(graph.root(wide), x);
    EXPECT_EQ(graph.root(back), x);
    EXPECT_EQ(graph.value(back).shape, (Shape{4, 8, 15}));
}

TEST_F(GraphRules, ParametersLieInBlocksWithTheirGradients) {
    Graph graph(*context_);
    const ValueId a = graph.parameter("a", {3, 5});
    const ValueId frozen = graph.parameter("frozen", {7}, false);
    const ValueId b = graph.parameter("b", {9});
    auto made = nn::Parameters::create(*context_, graph);
    ASSERT_OK(made.status());
    nn::Parameters& parameters = made.value();
    ASSERT_EQ(parameters.blocks().size(), 1U);
    EXPECT_EQ(parameters.elements(), 31U);
    const nn::ParameterBlock& block = parameters.blocks()[0];
    for (const ValueId id : {a, b}) {
        const nn::Parameter& p = parameters.of(id);
        EXPECT_EQ(p.value.offset - block.values.offset, p.grad.offset - block.grads.offset);
        EXPECT_TRUE(block.values.overlaps(p.value));
        EXPECT_TRUE(block.grads.overlaps(p.grad));
    }
    EXPECT_EQ(parameters.of(frozen).grad.block, nullptr);
    std::vector<float> values;
    ASSERT_OK(parameters.read(parameters.of(frozen).value, values));
    EXPECT_EQ(values, std::vector<float>(7, 0));
    const std::vector<float> nine = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    ASSERT_OK(parameters.write(*parameters.find("b"), nine));
    ASSERT_OK(parameters.read(parameters.of(b).value, values));
    EXPECT_EQ(values, nine);
    EXPECT_EQ(parameters.find("c"), nullptr);
}

TEST_F(GraphRules, ParametersWithoutGradientsTakeMemoryForValuesOnly) {
    Graph graph(*context_);
    graph.parameter("a", {1000, 1000});
    graph.parameter("frozen", {7}, false);
    const auto bytes_of = [&](bool gradients) {
        const std::uint64_t before = context_->memory().use().live;
        auto made = nn::Parameters::create(*context_, graph, gradients);
        EXPECT_OK(made.status());
        const nn::Parameter& a = *made.value().find("a");
        EXPECT_TRUE(a.trainable);
        EXPECT_EQ(a.grad.block != nullptr, gradients);
        EXPECT_EQ(made.value().blocks().size(), gradients ? 1U : 0U);
        EXPECT_OK(made.value().zero_gradients());
        return context_->memory().use().live - before;
    };
    // One million floats more, and at most the guards around two more buffers.
    const std::uint64_t more = bytes_of(true) - bytes_of(false);
    EXPECT_GE(more, 4000000U);
    EXPECT_LE(more, 4001024U);
}

}  // namespace
}  // namespace splat::test
