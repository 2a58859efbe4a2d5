// Blocks, adapters and resampling convolutions of golden/net, computed once with PyTorch in float64;
// see INDEX.md there for the keys.
#include <gtest/gtest.h>

#include <map>

#include "model/adapters.h"
#include "model/golden_layer.h"
#include "model/graph_reference.h"
#include "ops/op_harness.h"
#include "support/golden.h"
#include "support/rng_fill.h"
#include "support/tolerances.h"

namespace splat::test {
namespace {

using nn::kNoValue;
using nn::ValueId;

class GoldenNetLayers : public KernelsTest {
  protected:
    void SetUp() override {
        SPLAT_NEEDS_GOLDEN_FOLDER();
        KernelsTest::SetUp();
    }
    void expect_blocks(model::Precision precision);
};
SPLAT_INSTANTIATE_KERNELS(GoldenNetLayers);

/// The sizes of a block as its tensors have them.
Layers::BlockShape block_shape(const Golden& golden, const std::string& name) {
    const std::uint32_t before = golden.dim(name + ".x", 2);
    const std::uint32_t after = golden.dim(name + ".y", 2);
    return {golden.dim(name + ".x", 1), golden.dim(name + ".y", 1), after > before, after < before,
            golden.has(name + ".p.qkv.weight")};
}

/// `cfg` agrees with the tensors, and the block normalises in the groups of the network. Any other
/// file fails here and is not compared.
void expect_config(const Golden& golden, const std::string& name, const Layers::BlockShape& shape) {
    const std::string emb = name + ".emb";
    const std::vector<std::int64_t> expected = {shape.in,
                                                shape.out,
                                                golden.has(emb) ? golden.dim(emb, 1) : 0,
                                                shape.up,
                                                shape.down,
                                                shape.attention,
                                                golden.array(name + ".cfg").ints().value().at(6),
                                                model::norm_groups(shape.in),
                                                model::norm_groups(shape.out)};
    EXPECT_EQ(golden.array(name + ".cfg").ints().value(), expected) << golden.name << " " << name;
}

void GoldenNetLayers::expect_blocks(model::Precision precision) {
    each_case("block", "cfg",
              {"same", "wide", "att", "up", "dn", "film", "filmatt", "filmup", "filmdn", "att2v"},
              [&](const Golden& golden, const std::string& name) {
                  const Layers::BlockShape shape = block_shape(golden, name);
                  expect_config(golden, name, shape);
                  GoldenLayer layer{.golden = golden, .name = name, .precision = precision};
                  layer.config.views =
                      static_cast<std::uint32_t>(golden.array(name + ".cfg").ints().value().at(6));
                  layer.build = [&](Layers& layers, ValueId x) {
                      return layers.block(name, x, shape);
                  };
                  expect_golden_layer(context(), layer);
              });
}

TEST_P(GoldenNetLayers, Blocks) {
    expect_blocks(model::Precision::kStrict);
}

/// With F(4x4) wherever it can be, within the same figures; plain kernels have no other algorithm.
class GoldenNetLayersFast : public GoldenNetLayers {};
INSTANTIATE_TEST_SUITE_P(Kernels, GoldenNetLayersFast,
                         testing::Values(vk::Kernels::kCpu, vk::Kernels::kGpu), kernels_test_name);

TEST_P(GoldenNetLayersFast, Blocks) {
    expect_blocks(model::Precision::kFast);
}

/// The mask before conv1 that the other implementation drew.
TEST_P(GoldenNetLayers, BlockWithDropout) {
    each_case("block", "mask", {"drop"}, [&](const Golden& golden, const std::string& name) {
        GoldenLayer layer{.golden = golden, .name = name};
        layer.build = [&](Layers& layers, ValueId x) {
            return layers.block(name, x, block_shape(golden, name));
        };
        expect_golden_layer(context(), layer);
    });
}

/// `layer`: the name of the case, or of the first adapted layer of a block.
model::LoraConfig adapters(const Golden& golden, const std::string& name,
                           const std::string& layer) {
    model::LoraConfig lora;
    lora.rank = golden.dim(name + ".p." + layer + "lora_A", 0);
    lora.alpha = static_cast<float>(lora.rank) * golden.floats(name + ".scaling").at(0);
    return lora;
}

/// 1 of a matrix. `layer`: of a case of several layers, "q_proj.".
std::uint32_t kernel_of(const Golden& golden, const std::string& name,
                        const std::string& layer = "") {
    return golden.dim(name + ".p." + layer + "weight", 2);
}

/// Adapters as a second branch next to the frozen weight. A linear layer is a 1x1 convolution of
/// rows of one pixel, so matrices of the file are kernels of one tap here, with the same numbers.
TEST_P(GoldenNetLayers, Adapters) {
    each_case("lora", "p.lora_A", {"lin", "lindrop", "c3", "c1"},
              [&](const Golden& golden, const std::string& name) {
                  GoldenLayer layer{.golden = golden, .name = name};
                  layer.config.lora = adapters(golden, name, "");
                  layer.config.lora.targets = {name};
                  layer.config.lora.trained = {".bias"};
                  layer.build = [&](Layers& layers, ValueId x) {
                      return layers.conv(name, x, golden.dim(layer.key("y"), 1),
                                         kernel_of(golden, name), {}, kNoValue, 1, true);
                  };
                  expect_golden_layer(context(), layer);
              });
}

TEST_P(GoldenNetLayers, BlockWithAdapters) {
    each_case("lora", "p.conv1.lora_A", {"block"},
              [&](const Golden& golden, const std::string& name) {
                  GoldenLayer layer{.golden = golden, .name = name};
                  layer.config.lora = adapters(golden, name, "conv1.");
                  layer.config.lora.trained = {".norm", ".bias", ".skip"};
                  layer.build = [&](Layers& layers, ValueId x) {
                      return layers.block(name, x, block_shape(golden, name));
                  };
                  expect_golden_layer(context(), layer);
              });
}

/// Folded into the weight, adapters give the same outputs. (`merged_w` of the file is the weight itself.)
TEST_P(GoldenNetLayers, FoldedAdapters) {
    each_case(
        "lora", "merged_y", {"lin", "c3", "c1"},
        [&](const Golden& golden, const std::string& name) {
            io::NamedTensors state;
            for (const char* part : {"weight", "lora_A", "lora_B"})
                ASSERT_OK(state.add({name + "." + part, golden.dims(name + ".p." + part),
                                     io::NumberType::kF32, golden.floats(name + ".p." + part)}));
            const auto folded =
                need(model::merge_adapters(state, state, adapters(golden, name, "").alpha, 1));
            const auto tensor = [&](const std::string& key, std::vector<float> values) {
                std::vector<std::int64_t> dims = golden.dims(name + "." + key);
                dims.resize(4, 1);
                return HostTensor{Shape::create(dims, "golden").value(), std::move(values)};
            };
            OpCall call;
            call.op = "conv2d";
            call.inputs = {tensor("x", golden.floats(name + ".x")),
                           tensor("p.weight", folded.find(name + ".weight")->values),
                           {{golden.dim(name + ".p.bias", 0)}, golden.floats(name + ".p.bias")},
                           {}};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            for (const char* key : {".y64", ".merged_y"})
                expect_relative(name + key, gpu.outputs[0], golden.doubles(name + key), 1e-5);
        });
}

/// Cases of the file that resample and then convolve: with the box (`c…`), which the network uses, or
/// with other filters (`f<taps>…`), which only the operators support.
std::vector<std::string> resampling_cases(const Golden& golden, char kind) {
    std::vector<std::string> names;
    for (const std::string& name : golden.cases("p.weight"))
        if (name[0] == kind && golden.dim(name + ".x", 2) != golden.dim(name + ".y", 2))
            names.push_back(name);
    return names;
}

/// Covers the file of adapters, too: resampling convolutions get none.
TEST_P(GoldenNetLayers, ResamplingConvolutions) {
    const auto run = [&](const Golden& golden, const std::set<std::string>& of_shipped) {
        const std::vector<std::string> names = resampling_cases(golden, 'c');
        golden.expect_cases(names, of_shipped);
        for (const std::string& name : names) {
            GoldenLayer layer{.golden = golden, .name = name};
            const bool up = golden.dim(name + ".y", 2) > golden.dim(name + ".x", 2);
            layer.build = [&](Layers& layers, ValueId x) {
                return layers.conv(name, layers.resample(x, up), golden.dim(name + ".y", 1),
                                   kernel_of(golden, name), {});
            };
            expect_golden_layer(context(), layer);
        }
    };
    each_golden("conv", [&](const Golden& golden) {
        run(golden, {"c3up", "c3dn", "c1up", "c1dn"});
    });
    each_golden("lora", [&](const Golden& golden) { run(golden, {"c3up", "c3dn"}); });
}

/// The digits of the name are the taps.
HostTensor filter_of(const std::string& name) {
    std::vector<float> taps;
    for (std::size_t i = 1; i < name.size() && name[i] >= '0' && name[i] <= '9'; ++i)
        taps.push_back(static_cast<float>(name[i] - '0'));
    return {{static_cast<std::uint32_t>(taps.size())}, taps};
}

TEST_P(GoldenNetLayers, FilteredConvolutions) {
    each_golden("conv", [&](const Golden& golden) {
        const std::vector<std::string> names = resampling_cases(golden, 'f');
        golden.expect_cases(names, {"f1331up", "f1331dn"});
        for (const std::string& name : names) {
            const auto tensor = [&](const std::string& key) {
                return golden_tensor(golden.npz, name + "." + key);
            };
            const HostTensor x = tensor("x");
            const HostTensor grad_y = tensor("g");
            const bool up = grad_y.shape[2] > x.shape[2];
            OpCall resample;
            resample.op = "resample2d";
            resample.attributes = {{"up", up}, {"down", !up}};
            resample.inputs = {x, filter_of(name)};
            const OpResult middle = run_op(context(), resample);
            ASSERT_OK(middle.status) << name;
            const Shape between{x.shape[0], x.shape[1], grad_y.shape[2], grad_y.shape[3]};
            OpCall conv;
            conv.op = "conv2d";
            conv.inputs = {{between, middle.outputs[0]}, tensor("p.weight"), tensor("p.bias"), {}};
            conv.grad_outputs = {grad_y};
            const OpResult gpu = run_op(context(), conv);
            ASSERT_OK(gpu.status) << name;
            resample.grad_outputs = {{between, gpu.grad_inputs[0]}};
            const OpResult back = run_op(context(), resample);
            ASSERT_OK(back.status) << name;
            const auto at = [&](const char* key) { return golden.doubles(name + key); };
            expect_relative(name + " y", gpu.outputs[0], at(".y64"), 1e-5);
            expect_relative(name + " x", back.grad_inputs[0], at(".d_x64"), 1e-4);
            expect_relative(name + " weight", gpu.grad_inputs[1], at(".d.weight64"), 1e-4);
            expect_relative(name + " bias", gpu.grad_inputs[2], at(".d.bias64"), 1e-4);
        }
    });
}

/// Attention between two images as the published code defines it and never uses it: one norm for both,
/// keys and values alternate in the channels of one convolution.
TEST_P(GoldenNetLayers, CrossAttention) {
    each_golden("norm", [&](const Golden& golden) {
        golden.expect_cases(golden.cases("kv"), {"xatt"});
        const auto of = [&](const char* key) { return golden.floats("xatt." + std::string(key)); };
        nn::Graph graph(context());
        std::map<std::string, ValueId> values;
        const auto parameter = [&](const std::string& name, const Shape& shape) {
            return values[name] = graph.parameter(name, shape);
        };
        const auto image = [&](const char* key) {
            const std::string at = "xatt." + std::string(key);
            return graph.input(
                key, {golden.dim(at, 0), golden.dim(at, 1), golden.dim(at, 2), golden.dim(at, 3)});
        };
        const ValueId q = image("q");
        const ValueId kv = image("kv");
        const std::uint32_t channels = golden.dim("xatt.q", 1);
        const std::int64_t groups = model::norm_groups(channels);
        const ValueId gamma = parameter("norm.weight", {channels});
        const ValueId beta = parameter("norm.bias", {channels});
        const auto norm = [&](ValueId x) {
            return graph.op("group_norm", {x, gamma, beta}, {{"groups", groups}, {"eps", 1e-5}});
        };
        const auto conv = [&](const std::string& name, ValueId x, std::uint32_t kernel,
                              ValueId residual = kNoValue) {
            const ValueId weight =
                parameter(name + ".weight", {channels, channels, kernel, kernel});
            return graph.op("conv2d", {x, weight, parameter(name + ".bias", {channels}), residual});
        };
        const ValueId asked = norm(kv);
        const std::uint32_t kernel = kernel_of(golden, "xatt", "kv_proj.");
        const ValueId attended =
            graph.op("attention", {conv("q_proj", norm(q), kernel_of(golden, "xatt", "q_proj.")),
                                   conv("k_proj", asked, kernel), conv("v_proj", asked, kernel)});
        const ValueId y = conv("out_proj", attended, kernel_of(golden, "xatt", "out_proj."), q);
        ASSERT_OK(graph);
        auto run = need(GraphRun::create(context(), graph, y, {q, kv}));
        ASSERT_OK(run->put(q, of("q")));
        ASSERT_OK(run->put(kv, of("kv")));
        /// Rows 2i of kv_proj belong to keys, rows 2i + 1 to values.
        const auto rows = [channels](const auto& both, std::size_t first) {
            std::remove_cvref_t<decltype(both)> half;
            const std::size_t row = both.size() / (2 * channels);
            for (std::size_t i = 0; i < both.size(); ++i)
                if (i / row % 2 == first) half.push_back(both[i]);
            return half;
        };
        const auto each = [&](const auto& visit) {  // name here, name there, half of it
            for (const auto& [name, id] : values) {
                const bool key = name.starts_with("k_proj");
                const bool half = key || name.starts_with("v_proj");
                visit(id, half ? "kv" + name.substr(1) : name, half ? (key ? 0 : 1) : -1);
            }
        };
        each([&](ValueId id, const std::string& name, int half) {
            const auto all = of(("p." + name).c_str());
            EXPECT_OK(run->put(id, half < 0 ? all : rows(all, static_cast<std::size_t>(half))));
        });
        ASSERT_OK(run->run(of("g")));
        expect_relative("y", run->output(), golden.doubles("xatt.y64"), kGoldenLayer);
        const auto gradient = [&](const std::string& what, ValueId id,
                                  const std::vector<double>& expected) {
            if (what == "d.k_proj.bias") {  // softmax does not see it
                EXPECT_LE(norm_of(expected), 1e-12);
                EXPECT_LE(norm_of(to_double(run->gradient(id))), 1e-4);
                return;
            }
            expect_relative(what, run->gradient(id), expected, 1e-4);
        };
        gradient("d_q", q, golden.doubles("xatt.d_q64"));
        gradient("d_kv", kv, golden.doubles("xatt.d_kv64"));
        each([&](ValueId id, const std::string& name, int half) {
            const auto all = golden.doubles("xatt.d." + name + "64");
            gradient("d." + graph.value(id).name, id,
                     half < 0 ? all : rows(all, static_cast<std::size_t>(half)));
        });
    });
}

}  // namespace
}  // namespace splat::test
