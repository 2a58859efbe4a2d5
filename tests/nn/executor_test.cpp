#include "nn/executor.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "ref/linear_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using nn::Executor;
using nn::ExecutorDesc;
using nn::Graph;
using nn::Parameters;
using nn::ValueId;

using Values = std::vector<float>;

/// t = 2 h + x with h = W1 x + b1;  y = W2 t. The values x, h, s and t are each read by two: by two
/// nodes, or by a node and the caller. All numbers are whole, so every sum is exact.
class Network {
  public:
    static constexpr std::uint32_t kRows = 3;
    static constexpr std::uint32_t kIn = 8;
    static constexpr std::uint32_t kOut = 6;

    explicit Network(vk::Context& context, bool trainable_first = true)
        : context_(context), graph(context) {
        x = graph.input("x", {kRows, kIn});
        w1 = graph.parameter("w1", {kIn, kIn}, trainable_first);
        b1 = graph.parameter("b1", {kIn}, trainable_first);
        w2 = graph.parameter("w2", {kOut, kIn});
        const ValueId h = graph.op("linear", {x, w1, b1});
        const ValueId s = graph.op("add", {h, x});
        t = graph.op("add", {s, h});
        y = graph.op("linear", {t, w2});
    }

    Status create(const ExecutorDesc& desc) {
        SPLAT_ASSIGN(Parameters made, Parameters::create(context_, graph));
        parameters = std::make_unique<Parameters>(std::move(made));
        SPLAT_TRY(parameters->write(parameters->of(w1), w1_values));
        SPLAT_TRY(parameters->write(parameters->of(b1), b1_values));
        SPLAT_TRY(parameters->write(parameters->of(w2), w2_values));
        SPLAT_TRY(parameters->zero_gradients());
        SPLAT_ASSIGN(executor, Executor::create(context_, graph, *parameters, desc));
        return {};
    }

    Status forward() {
        SPLAT_TRY(put(executor->tensor(x), x_values));
        return executor->forward();
    }
    Status backward() {
        SPLAT_TRY(put(executor->gradient(y), grad_y));
        SPLAT_TRY(put(executor->gradient(t), grad_t));
        return executor->backward();
    }

    Values get(const vk::BufferView& view) const {
        Values values(view.shape.elements());
        EXPECT_OK(context_.read(view, values.data(), values.size() * 4));
        return values;
    }
    Values grad(ValueId id) const { return get(parameters->of(id).grad); }

    [[nodiscard]] ExecutorDesc whole() const {
        return {.outputs = {y, t}, .backward = true, .grad_outputs = {y, t}, .grad_inputs = {x}};
    }

    vk::Context& context_;
    Graph graph;
    std::unique_ptr<Parameters> parameters;
    std::unique_ptr<Executor> executor;
    ValueId x, w1, b1, w2, t, y;
    Values x_values = integer_fill(std::size_t{kRows} * kIn, 1);
    Values w1_values = integer_fill(std::size_t{kIn} * kIn, 2);
    Values b1_values = integer_fill(kIn, 3);
    Values w2_values = integer_fill(std::size_t{kOut} * kIn, 4);
    Values grad_y = integer_fill(std::size_t{kRows} * kOut, 5);
    Values grad_t = integer_fill(std::size_t{kRows} * kIn, 6);

  private:
    Status put(const vk::BufferView& view, const Values& values) {
        return context_.write(view, values.data(), values.size() * 4);
    }
};

struct Expected {
    std::vector<double> t, y, grad_x, grad_w1, grad_b1, grad_w2;
};

std::vector<double> sum(const std::vector<double>& a, double factor, const std::vector<double>& b) {
    std::vector<double> result = a;
    for (std::size_t i = 0; i < a.size(); ++i) result[i] += factor * b[i];
    return result;
}

Expected expected(const Network& n) {
    const ref::LinearInput<double> first{{Network::kRows, Network::kIn, Network::kIn},
                                         to_double(n.x_values),
                                         to_double(n.w1_values),
                                         to_double(n.b1_values)};
    Expected e;
    e.t = sum(to_double(n.x_values), 2, ref::linear_forward(first).value);
    const ref::LinearInput<double> second{
        {Network::kRows, Network::kIn, Network::kOut}, e.t, to_double(n.w2_values), {}};
    e.y = ref::linear_forward(second).value;
    const auto back2 = ref::linear_backward(second, to_double(n.grad_y));
    const std::vector<double> grad_t = sum(to_double(n.grad_t), 1, back2.grad_x.value);
    const std::vector<double> grad_h = sum(grad_t, 1, grad_t);
    const auto back1 = ref::linear_backward(first, grad_h);
    e.grad_w2 = back2.grad_weight.value;
    e.grad_w1 = back1.grad_weight.value;
    e.grad_b1 = back1.grad_bias.value;
    e.grad_x = sum(grad_t, 1, back1.grad_x.value);
    return e;
}

class ExecutorRules : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(ExecutorRules);

TEST_P(ExecutorRules, GradientsOfSharedValuesAreSums) {
    Network n(context());
    ASSERT_OK(n.graph.status());
    ASSERT_OK(n.create(n.whole()));
    ASSERT_OK(n.forward());
    ASSERT_OK(n.backward());
    const Expected e = expected(n);
    EXPECT_EQ(to_double(n.get(n.executor->tensor(n.y))), e.y);
    EXPECT_EQ(to_double(n.get(n.executor->tensor(n.t))), e.t);
    EXPECT_EQ(to_double(n.get(n.executor->gradient(n.x))), e.grad_x);
    EXPECT_EQ(to_double(n.grad(n.w1)), e.grad_w1);
    EXPECT_EQ(to_double(n.grad(n.b1)), e.grad_b1);
    EXPECT_EQ(to_double(n.grad(n.w2)), e.grad_w2);
}

/// Rows of `channels` as quads, [ceil(C/4)][rows], with `pad` in the channels beyond the last.
Values quads_of(const Values& rows, std::uint32_t channels, float pad) {
    Values quads;
    for (std::uint32_t first = 0; first < channels; first += 4)
        for (std::uint32_t row = 0; row < Network::kRows; ++row)
            for (std::uint32_t c = first; c < first + 4; ++c)
                quads.push_back(c < channels ? rows[row * channels + c] : pad);
    return quads;
}

TEST_P(ExecutorRules, QuadsOfTheCallerAreUsedInPlace) {
    Network n(context());
    const Values ones(n.x_values.size(), 1);
    const vk::Buffer x = upload(context(), quads_of(n.x_values, Network::kIn, 0));
    const vk::Buffer grad_x = upload(context(), quads_of(ones, Network::kIn, 0));
    const vk::Buffer y = upload(context(), quads_of(n.grad_y, Network::kOut, 7));
    const vk::Buffer grad_y = upload(context(), quads_of(n.grad_y, Network::kOut, 0));
    ExecutorDesc desc = n.whole();
    desc.outputs = {n.y};
    desc.grad_outputs = {n.y};
    desc.quads = {n.x, n.y};
    desc.tensors = {{n.x, x.range()}, {n.y, y.range()}};
    desc.gradients = {{n.x, grad_x.range()}, {n.y, grad_y.range()}};
    n.grad_t.assign(n.grad_t.size(), 0);
    const Expected e = expected(n);
    const auto to_quads = [](const std::vector<double>& rows, std::uint32_t channels) {
        return quads_of({rows.begin(), rows.end()}, channels, 0);
    };
    ASSERT_OK(n.create(desc));
    EXPECT_TRUE(n.executor->tensor(n.x).same_range(x.range()));
    EXPECT_TRUE(n.executor->gradient(n.x).same_range(grad_x.range()));
    ASSERT_OK(n.executor->forward());
    EXPECT_EQ(download(context(), y.range(), 24), to_quads(e.y, Network::kOut));
    ASSERT_OK(n.executor->backward());
    EXPECT_EQ(download(context(), grad_x.range(), 24),
              to_quads(sum(e.grad_x, 1, to_double(ones)), Network::kIn));
    EXPECT_EQ(download(context(), x.range(), 24), quads_of(n.x_values, Network::kIn, 0));
    EXPECT_EQ(to_double(n.grad(n.w1)), e.grad_w1);
    EXPECT_EQ(to_double(n.grad(n.w2)), e.grad_w2);
}

TEST_P(ExecutorRules, ParameterGradientsAddUp) {
    Network n(context());
    ASSERT_OK(n.create(n.whole()));
    for (int batch = 0; batch < 3; ++batch) {
        ASSERT_OK(n.forward());
        ASSERT_OK(n.backward());
    }
    const Expected e = expected(n);
    EXPECT_EQ(to_double(n.grad(n.w1)), sum(e.grad_w1, 2, e.grad_w1));
    EXPECT_EQ(to_double(n.get(n.executor->gradient(n.x))), e.grad_x) << "of inputs are not sums";
    ASSERT_OK(n.parameters->zero_gradients());
    EXPECT_EQ(n.grad(n.w2), Values(e.grad_w2.size(), 0));
}

/// Values that only one segment reads are computed twice; values that the next one reads are not. All
/// results have the same bits.
TEST_P(ExecutorRules, RecomputesWhatASegmentKeeps) {
    std::uint64_t bounds[2] = {};
    std::vector<Values> first;
    for (const bool recompute : {false, true}) {
        Graph graph(context());
        const ValueId x = graph.input("x", {64, 64});
        const ValueId w = graph.parameter("w", {64, 64});
        ValueId y = x;
        for (int segment = 0; segment < 6; ++segment) {
            graph.begin_segment();
            const ValueId a = graph.op("linear", {y, w});
            const ValueId b = graph.op("linear", {graph.op("add", {a, y}, {{"scale", 0.5}}), w});
            y = graph.op("add", {graph.op("linear", {b, w}), a}, {{"scale", 0.25}});
        }
        auto parameters = Parameters::create(context(), graph);
        ASSERT_OK(parameters.status());
        const Values weights = normal_fill(64 * 64, 7, 0, 0.1);
        ASSERT_OK(parameters.value().write(parameters.value().of(w), weights));
        ASSERT_OK(parameters.value().zero_gradients());
        auto made = Executor::create(context(), graph, parameters.value(),
                                     {.outputs = {y},
                                      .backward = true,
                                      .grad_outputs = {y},
                                      .grad_inputs = {x},
                                      .keep_prepared = false,
                                      .recompute = recompute});
        ASSERT_OK(made.status());
        Executor& executor = *made.value();
        bounds[recompute ? 1 : 0] = executor.memory().bound;
        const Values values = normal_fill(64 * 64, 8);
        const auto put = [&](const vk::BufferView& view) {
            return context().write(view, values.data(), values.size() * 4);
        };
        std::vector<Values> results;
        const auto get = [&](const vk::BufferView& view) {
            results.emplace_back(view.shape.elements());
            ASSERT_OK(context().read(view, results.back().data(), results.back().size() * 4));
        };
        ASSERT_OK(put(executor.tensor(x)));
        ASSERT_OK(executor.forward());
        ASSERT_OK(put(executor.gradient(y)));
        ASSERT_OK(executor.backward());
        get(executor.tensor(y));
        get(executor.gradient(x));
        get(parameters.value().of(w).grad);
        if (!recompute) first = results;
        EXPECT_EQ(results, first);
    }
    // Two more tensors are kept for each of five segments; of the running segment, a few live both
    // times.
    EXPECT_LE(bounds[1] + 5 * 64 * 64 * 4, bounds[0]);
}

/// A gradient computed alone, without the others, is that of the whole network.
TEST_P(ExecutorRules, WhatIsFrozenCostsNothing) {
    Network whole(context());
    ASSERT_OK(whole.create(whole.whole()));
    Network frozen(context(), false);
    ExecutorDesc desc = frozen.whole();
    desc.grad_inputs = {};
    desc.grad_outputs = {frozen.y};
    ASSERT_OK(frozen.create(desc));
    EXPECT_EQ(frozen.parameters->of(frozen.w1).grad.block, nullptr);
    ASSERT_OK(frozen.forward());
    const Values ones(frozen.grad_y);
    ASSERT_OK(context().write(frozen.executor->gradient(frozen.y), ones.data(), ones.size() * 4));
    ASSERT_OK(frozen.executor->backward());
    EXPECT_EQ(to_double(frozen.grad(frozen.w2)), expected(frozen).grad_w2);
    EXPECT_LT(frozen.executor->memory().bound, whole.executor->memory().bound);
}

/// Where gradients do not read their inputs, an activation is freed after its last use forward:
/// around frozen convolutions with residuals, and in the resampling, joining and averaging of
/// images.
TEST_P(ExecutorRules, KeepsNothingThatBackwardDoesNotRead) {
    const auto bound = [&](int links) -> std::uint64_t {
        Graph graph(context());
        const ValueId x = graph.input("x", {1, 8, 16, 16});
        const ValueId join = graph.parameter("join", {8, 16, 1, 1}, false);
        ValueId y = x;
        for (int link = 0; link < links; ++link) {
            const ValueId large = graph.op("resample2d", {y}, {{"up", true}});
            const ValueId small = graph.op("resample2d", {large}, {{"down", true}});
            const ValueId both = graph.op("concat", {small, y});
            y = graph.op("conv2d", {both, join, nn::kNoValue, small}, {{"scale", 0.5}});
            y = graph.op("add", {y, small}, {{"scale", 0.5}});
        }
        auto parameters = Parameters::create(context(), graph);
        EXPECT_OK(parameters.status());
        auto executor = Executor::create(context(), graph, parameters.value(),
                                         {.outputs = {y},
                                          .backward = true,
                                          .grad_outputs = {y},
                                          .grad_inputs = {x},
                                          .keep_prepared = false});
        EXPECT_OK(executor.status());
        return executor.ok() ? executor.value()->memory().bound : 0;
    };
    EXPECT_EQ(bound(3), bound(12));
}

/// A graph alone tells what its forward pass takes.
TEST_P(ExecutorRules, MemoryIsToldBeforeItIsAllocated) {
    Graph graph(context());
    const ValueId x = graph.input("x", {1, 8, 32, 32});
    const ValueId w = graph.parameter("w", {8, 16, 3, 3});
    ValueId y = x;
    for (int link = 0; link < 4; ++link) {
        const ValueId both = graph.op("concat", {graph.op("silu", {y}), y});
        y = graph.op("conv2d", {both, w});
    }
    auto parameters = Parameters::create(context(), graph, false);
    ASSERT_OK(parameters.status());
    ExecutorDesc desc;
    desc.outputs = {y};
    desc.keep_prepared = false;
    const auto executor = need(Executor::create(context(), graph, parameters.value(), desc));
    desc.keep_prepared = true;
    const auto keeping = need(Executor::create(context(), graph, parameters.value(), desc));
    for (int pass = 0; pass < 2; ++pass) ASSERT_OK(keeping->forward());
    const Graph::Bytes told = graph.forward_bytes();
    EXPECT_EQ(told.parameters, std::uint64_t{8} * 16 * 9 * 4);
    const auto bound = static_cast<double>(executor->memory().bound);
    EXPECT_NEAR(static_cast<double>(told.pass), bound, 0.3 * bound);
    EXPECT_EQ(told.prepared, keeping->memory().prepared);
}

TEST_P(ExecutorRules, SameBitsOnEveryRunAndPoison) {
    std::vector<Values> first;
    for (const std::uint32_t pattern : kPoisonPatterns)
        for (const bool keep : {false, true}) {
            vk::Context* poisoned = poisoned_context(GetParam(), pattern);
            ASSERT_NE(poisoned, nullptr);
            Network n(*poisoned, !keep);
            n.x_values = normal_fill(n.x_values.size(), 11);
            n.w1_values = normal_fill(n.w1_values.size(), 12);
            ExecutorDesc desc = n.whole();
            desc.keep_prepared = keep;
            ASSERT_OK(n.create(desc));
            for (int run = 0; run < 2; ++run) {
                ASSERT_OK(n.parameters->zero_gradients());
                ASSERT_OK(n.forward());
                ASSERT_OK(n.backward());
                const std::vector<Values> all = {n.get(n.executor->tensor(n.y)),
                                                 n.get(n.executor->gradient(n.x)), n.grad(n.w2)};
                if (first.empty()) first = all;
                for (std::size_t i = 0; i < all.size(); ++i)
                    EXPECT_TRUE(bit_equal(first[i], all[i], {"tensor " + std::to_string(i), ""}));
            }
        }
}

/// Prepared parameters follow when values change.
TEST_P(ExecutorRules, ChangedParametersArePreparedAnew) {
    Network n(context(), false);
    ExecutorDesc desc = n.whole();
    desc.backward = false;
    desc.grad_outputs = desc.grad_inputs = {};
    ASSERT_OK(n.create(desc));
    for (const std::uint64_t seed : {31, 32, 33}) {
        n.w1_values = integer_fill(n.w1_values.size(), seed);
        ASSERT_OK(n.parameters->write(n.parameters->of(n.w1), n.w1_values));
        for (int pass = 0; pass < 3; ++pass) {  // the second one keeps prepared parameters
            ASSERT_OK(n.forward());
            EXPECT_EQ(to_double(n.get(n.executor->tensor(n.y))), expected(n).y) << seed;
        }
    }
}

TEST_P(ExecutorRules, RefusesWhatCannotBe) {
    Network n(context());
    ExecutorDesc desc = n.whole();
    desc.outputs = {n.y};
    EXPECT_ERROR(n.create(desc), Code::kInvalidArgument, "it is not an output");
    desc.outputs = desc.grad_outputs = {n.t};
    desc.grad_inputs = {n.y};
    EXPECT_ERROR(n.create(desc), Code::kInvalidArgument, "requested, but no output depends on it");
    desc = n.whole();
    desc.backward = false;
    desc.grad_outputs = desc.grad_inputs = {};
    ASSERT_OK(n.create(desc));
    EXPECT_ERROR(n.executor->backward(), Code::kInvalidState, "without gradients");
    ASSERT_OK(n.create(n.whole()));
    EXPECT_ERROR(n.executor->backward(), Code::kInvalidState, "run forward before each");
    ASSERT_OK(n.forward());
    ASSERT_OK(n.backward());
    EXPECT_ERROR(n.executor->backward(), Code::kInvalidState, "run forward before each");
}

}  // namespace
}  // namespace splat::test
