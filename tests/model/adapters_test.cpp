#include "model/adapters.h"

#include <gtest/gtest.h>

#include "model/golden_layer.h"
#include "model/graph_reference.h"
#include "ops/op_harness.h"
#include "support/rng_fill.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

using model::Model;
using model::ModelConfig;

constexpr const char* kConv0 = "base_model.model.network_with_offset.encoder.enc.8x8_block0.conv0";

/// Files of adapters alone: nothing runs, so one set of kernels is enough.
class Adapters : public KernelsTest {
  protected:
    std::unique_ptr<Model> make(std::uint64_t seed, std::uint32_t rank = 3, float alpha = 6,
                                bool offset = true) {
        ModelConfig config;
        config.offset = offset;
        config.resolution = 8;
        config.base_dim = 4;
        config.num_blocks = 1;
        config.channel_mult = {1};
        config.attention_resolutions = {8};
        config.lora.rank = rank;
        config.lora.alpha = alpha;
        auto made = need(Model::create(context(), config, {}));
        for (const nn::Parameter& parameter : made->parameters().all())
            EXPECT_OK(made->parameters().write(parameter,
                                               normal_fill(parameter.shape.elements(), seed++)));
        return made;
    }
    std::vector<float> read(Model& model, const nn::Parameter& parameter) {
        std::vector<float> values;
        EXPECT_OK(model.parameters().read(parameter.value, values));
        return values;
    }
};
INSTANTIATE_TEST_SUITE_P(Kernels, Adapters, testing::Values(vk::Kernels::kPlain),
                         kernels_test_name);

TEST_P(Adapters, GoRoundUnderTheNamesOfPeft) {
    const auto first = make(10);
    const auto second = make(500);
    const auto file = need(model::save_adapters(*first));
    const io::NamedTensor* a = file.tensors.find(std::string(kConv0) + ".lora_A.weight");
    const io::NamedTensor* b = file.tensors.find(std::string(kConv0) + ".lora_B.weight");
    ASSERT_TRUE(a != nullptr && b != nullptr);
    EXPECT_EQ(a->dims, (std::vector<std::int64_t>{3, 4, 3, 3}));
    EXPECT_EQ(b->dims, (std::vector<std::int64_t>{4, 3, 1, 1}));
    EXPECT_EQ(file.metadata,
              (io::Metadata{{"format", "pt"}, {"lora_alpha", "6"}, {"lora_rank", "3"}}));

    model::LoadReport report;
    ASSERT_OK(model::load_adapters(*second, file, report));
    EXPECT_EQ(report.copied.size(), file.tensors.size());
    const auto untouched = make(500);
    for (const nn::Parameter& parameter : second->parameters().all()) {
        const bool adapter = parameter.name.find(".lora_") != std::string::npos;
        const auto& from = adapter ? first : untouched;
        EXPECT_EQ(read(*second, parameter), read(*from, *from->parameters().find(parameter.name)))
            << parameter.name;
    }
}

TEST_P(Adapters, AreReadUnderTheNamesOfStateDicts) {
    const auto first = make(10);
    const auto second = make(500);
    const auto state = need(model::save_state(*first));
    io::WeightsFile file;
    for (const io::NamedTensor& tensor : state)
        if (tensor.name.find(".lora_") != std::string::npos) {
            ASSERT_OK(file.tensors.add(tensor));
        }
    model::LoadReport report;
    ASSERT_OK(model::load_adapters(*second, file, report));
    const char* name = "network_with_offset.encoder.dec.8x8_in0.qkv.lora_B";
    EXPECT_EQ(read(*second, *second->parameters().find(name)), state.find(name)->values);
}

/// Networks without offset were once saved under the names of those with one.
TEST_P(Adapters, AreReadUnderEarlierNames) {
    const auto first = make(10, 3, 6, false);
    const auto second = make(500, 3, 6, false);
    const auto state = need(model::save_state(*first));
    const auto file = need(model::save_adapters(*first));
    const auto earlier = [](const io::NamedTensors& tensors) {
        io::NamedTensors renamed;
        for (io::NamedTensor tensor : tensors) {
            const std::size_t at = tensor.name.find("network_wo_offset.");
            if (at != std::string::npos) tensor.name.replace(at, 17, "network_with_offset");
            EXPECT_OK(renamed.add(std::move(tensor)));
        }
        return renamed;
    };
    io::WeightsFile old;
    old.tensors = earlier(file.tensors);
    ASSERT_NE(old.tensors.find(std::string(kConv0) + ".lora_A.weight"), nullptr);
    model::LoadReport report;
    ASSERT_OK(model::load_adapters(*second, old, report));
    const char* name = "network_wo_offset.encoder.dec.8x8_in0.qkv.lora_B";
    EXPECT_EQ(read(*second, *second->parameters().find(name)), state.find(name)->values);

    const auto merged = need(model::merge_adapters(state, file.tensors, 6, 1));
    const io::NamedTensors old_state = earlier(state);
    const std::pair<const io::NamedTensors*, const io::NamedTensors*> pairs[] = {
        {&state, &old.tensors}, {&old_state, &file.tensors}, {&old_state, &old.tensors}};
    for (const auto& [weights, adapters] : pairs) {
        const auto again = need(model::merge_adapters(*weights, *adapters, 6, 1));
        ASSERT_EQ(again.size(), merged.size());
        for (std::size_t i = 0; i < merged.size(); ++i)
            EXPECT_EQ(again[i].values, merged[i].values) << again[i].name;
    }
}

TEST_P(Adapters, RefusesOtherFiles) {
    const auto model = make(10);
    const auto without = make(20, 0);
    const auto saved = need(model::save_adapters(*model));
    model::LoadReport report;
    EXPECT_ERROR(model::save_adapters(*without), Code::kInvalidState, "no adapters");
    EXPECT_ERROR(model::load_adapters(*without, saved, report), Code::kInvalidState, "no adapters");
    const auto other = make(30, 3, 7);
    EXPECT_ERROR(model::load_adapters(*other, saved, report), Code::kInvalidArgument,
                 "lora_alpha 6, the configuration has 7");
    const auto wider = make(30, 2);
    EXPECT_ERROR(model::load_adapters(*wider, saved, report), Code::kShape,
                 "has shape [3, 36], expected [2, 36]");

    const auto changed = [&](const std::function<void(io::NamedTensor&)>& change) {
        io::WeightsFile file;
        for (io::NamedTensor tensor : saved.tensors) {
            if (tensor.name == std::string(kConv0) + ".lora_B.weight") change(tensor);
            if (!tensor.name.empty()) {
                EXPECT_OK(file.tensors.add(std::move(tensor)));
            }
        }
        return file;
    };
    const auto status = [&](const std::function<void(io::NamedTensor&)>& change) {
        return model::load_adapters(*model, changed(change), report);
    };
    EXPECT_ERROR(status([](io::NamedTensor& t) { t.name.clear(); }), Code::kInvalidArgument,
                 "has no adapter 'network_with_offset.encoder.enc.8x8_block0.conv0.lora_B' [4, 3]");
    EXPECT_ERROR(status([](io::NamedTensor& t) { t.name = "out.weight"; }), Code::kInvalidArgument,
                 "'out.weight' is not an adapter");
    EXPECT_ERROR(status([](io::NamedTensor& t) { t.values.own()[5] = NAN; }),
                 Code::kInvalidArgument, "holds nan at element 5");
    EXPECT_ERROR(status([](io::NamedTensor& t) {
                     t.dims = {0};
                     t.values = {};
                 }),
                 Code::kShape, "expected a matrix");
    io::WeightsFile more = saved;
    ASSERT_OK(more.tensors.add({"elsewhere.lora_A", {3, 1}, io::NumberType::kF32, {1, 2, 3}}));
    EXPECT_ERROR(model::load_adapters(*model, more, report), Code::kInvalidArgument,
                 "'elsewhere.lora_A' belongs to no adapted layer");
    const auto state = need(model::save_state(*model));
    EXPECT_ERROR(model::merge_adapters(state, more.tensors, 6, 1), Code::kInvalidArgument,
                 "the adapter 'elsewhere.lora_A' belongs to no weight: the file has no "
                 "'elsewhere.weight'");
    EXPECT_ERROR(model::merge_adapters(
                     state, changed([](io::NamedTensor& t) { t.name.clear(); }).tensors, 6, 1),
                 Code::kInvalidArgument, "only one half");
    EXPECT_ERROR(model::merge_adapters(state, changed([](io::NamedTensor& t) {
                                                  t.dims = {3, 4};
                                              }).tensors,
                                       6, 1),
                 Code::kShape, "do not multiply");
}

/// Layers with adapters on whole numbers, where every sum is exact: 3x3 and 1x1 convolutions and
/// linear layers, of sizes that fill vectors and tiles and of others.
class AdaptersExact : public KernelsTest {
  protected:
    void expect_exact(const nn::Graph& graph, nn::ValueId y, nn::ValueId x,
                      const std::string& what) {
        ASSERT_OK(graph) << what;
        auto gpu = GraphRun::create(context(), graph, y, {x});
        ASSERT_OK(gpu) << what;
        GraphReference reference(graph);
        std::vector<nn::ValueId> leaves;
        for (nn::ValueId id = 0; id < graph.values().size(); ++id)
            if (graph.value(id).kind != nn::ValueKind::kActivation &&
                graph.value(id).base == nn::kNoValue)
                leaves.push_back(id);
        for (const nn::ValueId id : leaves) {
            const auto numbers = integer_fill(graph.value(id).shape.elements(), 40 + id);
            reference.put(id, to_double(numbers));
            ASSERT_OK(gpu.value()->put(id, numbers));
        }
        const auto grad = integer_fill(graph.value(y).shape.elements(), 39);
        ASSERT_OK(gpu.value()->run(grad));
        reference.forward();
        reference.backward(y, to_double(grad));
        EXPECT_EQ(to_double(gpu.value()->output()), reference.value(y)) << what;
        for (const nn::ValueId id : leaves)
            if (id == x || graph.value(id).trainable) {
                EXPECT_EQ(to_double(gpu.value()->gradient(id)), reference.gradient(id))
                    << what << " gradient of " << graph.value(id).name;
            }
    }
};
SPLAT_INSTANTIATE_KERNELS(AdaptersExact);

TEST_P(AdaptersExact, Convolutions) {
    for (const ConvShape& s :
         {ConvShape{1, 1, 1, 1, 1, 3}, ConvShape{2, 3, 5, 7, 9, 3}, ConvShape{1, 16, 8, 8, 16, 3},
          ConvShape{3, 7, 9, 4, 17, 3}, ConvShape{1, 33, 3, 3, 31, 3}, ConvShape{1, 5, 1, 65, 8, 1},
          ConvShape{2, 17, 4, 3, 33, 1}, ConvShape{1, 64, 8, 8, 65, 1}}) {
        model::ModelConfig config;
        config.lora.rank = 4;
        config.lora.alpha = 8;
        config.lora.targets = {"layer"};
        config.lora.trained = {"layer"};
        nn::Graph graph(context());
        Layers layers(graph, config, {.precision = model::Precision::kStrict});
        const nn::ValueId x = graph.input("x", {s.N, s.C, s.H, s.W});
        const nn::ValueId y = layers.conv("layer", x, s.K, s.R, {}, nn::kNoValue, 1, true);
        expect_exact(graph, y, x, s.text());
    }
}

TEST_P(AdaptersExact, LinearLayers) {
    for (const MatrixShape& s :
         {MatrixShape{1, 1, 1}, MatrixShape{7, 8, 9}, MatrixShape{17, 15, 31},
          MatrixShape{65, 63, 33}, MatrixShape{129, 5, 3}}) {
        nn::Graph graph(context());
        const nn::ValueId x = graph.input("x", {s.rows, s.in});
        const nn::ValueId weight = graph.parameter("weight", {s.out, s.in});
        const nn::ValueId bias = graph.parameter("bias", {s.out});
        const nn::ValueId a = graph.parameter("lora_A", {3, s.in});
        const nn::ValueId b = graph.parameter("lora_B", {s.out, 3});
        const nn::ValueId branch = graph.op("linear", {graph.op("linear", {x, a}), b});
        const nn::ValueId y = graph.op("add", {graph.op("linear", {x, weight, bias}), branch});
        expect_exact(graph, y, x, s.text());
    }
}

}  // namespace
}  // namespace splat::test
