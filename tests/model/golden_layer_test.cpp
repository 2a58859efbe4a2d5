// Blocks, adapters and resampling convolutions of golden/net, computed once with PyTorch in float64;
// see INDEX.md there for the keys.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
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
    template <class Body>
    void each_file(const char* family, const Body& body) {
        for (const std::string& path : golden_files("net", family)) {
            auto npz = Npz::read(path);
            ASSERT_OK(npz.status());
            body(Golden{std::move(npz.value()), std::filesystem::path(path).stem().string()});
        }
    }
    void expect_blocks(model::Precision precision) {
        each_file("block", [&](const Golden& golden) {
            for (const char* name : {"same", "wide", "att", "up", "dn", "film", "filmatt", "filmup",
                                     "filmdn", "att2v"}) {
                const auto cfg = golden.array(std::string(name) + ".cfg").ints().value();
                GoldenLayer layer{.golden = golden, .name = name, .precision = precision};
                layer.config.views = static_cast<std::uint32_t>(cfg.at(6));
                const Layers::BlockShape shape{static_cast<std::uint32_t>(cfg.at(0)),
                                               static_cast<std::uint32_t>(cfg.at(1)),
                                               cfg.at(3) != 0, cfg.at(4) != 0, cfg.at(5) != 0};
                layer.build = [&](Layers& layers, ValueId x) {
                    return layers.block(name, x, shape);
                };
                expect_golden_layer(context(), layer);
            }
        });
    }
};
SPLAT_INSTANTIATE_KERNELS(GoldenNetLayers);

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
    each_file("block", [&](const Golden& golden) {
        GoldenLayer layer{.golden = golden, .name = "drop"};
        layer.build = [](Layers& layers, ValueId x) {
            return layers.block("drop", x, {16, 24, false, false, false});
        };
        expect_golden_layer(context(), layer);
    });
}

model::LoraConfig adapters(const Golden& golden, const std::string& name) {
    model::LoraConfig lora;
    lora.rank = 4;
    lora.alpha = 4 * golden.floats(name + ".scaling").at(0);
    return lora;
}

/// Adapters as a second branch beside the frozen weight. A linear layer is a 1x1 convolution of rows of
/// one pixel.
TEST_P(GoldenNetLayers, Adapters) {
    each_file("lora", [&](const Golden& golden) {
        for (const char* name : {"lin", "lindrop", "c3", "c1"}) {
            GoldenLayer layer{.golden = golden, .name = name};
            layer.config.lora = adapters(golden, name);
            layer.config.lora.targets = {name};
            layer.config.lora.trained = {".bias"};
            const auto y = golden.dims(layer.key("y"));
            const std::uint32_t kernel = std::string(name) == "c3" ? 3 : 1;
            layer.build = [&](Layers& layers, ValueId x) {
                return layers.conv(name, x, static_cast<std::uint32_t>(y[1]), kernel, {}, kNoValue,
                                   1, true);
            };
            // Matrices of the file are kernels of one tap here; the numbers are the same.
            expect_golden_layer(context(), layer);
        }
    });
}

TEST_P(GoldenNetLayers, BlockWithAdapters) {
    each_file("lora", [&](const Golden& golden) {
        GoldenLayer layer{.golden = golden, .name = "block"};
        layer.config.lora = adapters(golden, "block");
        layer.config.lora.trained = {".norm", ".bias", ".skip"};
        layer.build = [](Layers& layers, ValueId x) {
            return layers.block("block", x, {16, 24, false, false, true});
        };
        expect_golden_layer(context(), layer);
    });
}

/// Folded into the weight, adapters give the same outputs. (`merged_w` of the file is the weight itself.)
TEST_P(GoldenNetLayers, FoldedAdapters) {
    each_file("lora", [&](const Golden& golden) {
        for (const char* name : {"lin", "c3", "c1"}) {
            const std::string at = name;
            io::NamedTensors state;
            for (const char* part : {"weight", "lora_A", "lora_B"})
                ASSERT_OK(state.add({at + "." + part, golden.dims(at + ".p." + part),
                                     io::NumberType::kF32, golden.floats(at + ".p." + part)}));
            const model::LoraConfig lora = adapters(golden, name);
            const auto folded = model::merge_adapters(state, state, lora.alpha, 1);
            ASSERT_OK(folded.status());
            const auto tensor = [&](const std::string& key, std::vector<float> values) {
                std::vector<std::int64_t> dims = golden.dims(at + "." + key);
                dims.resize(4, 1);
                return HostTensor{Shape::create(dims, "golden").value(), std::move(values)};
            };
            OpCall call;
            call.op = "conv2d";
            call.inputs = {tensor("x", golden.floats(at + ".x")),
                           tensor("p.weight", folded.value().find(at + ".weight")->values),
                           {{static_cast<std::uint32_t>(golden.dims(at + ".p.bias")[0])},
                            golden.floats(at + ".p.bias")},
                           {}};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            for (const char* key : {".y64", ".merged_y"})
                expect_relative(at + key, gpu.outputs[0], golden.doubles(at + key), 1e-5);
        }
    });
}

/// Convolutions after resampling by two, those of a file of adapters, too: they have none.
TEST_P(GoldenNetLayers, ResamplingConvolutions) {
    const auto run = [&](const Golden& golden, const std::string& name) {
        const bool up = name.ends_with("up");
        GoldenLayer layer{.golden = golden, .name = name};
        const std::uint32_t kernel = name[1] == '1' ? 1 : 3;
        layer.build = [&](Layers& layers, ValueId x) {
            return layers.conv(name, layers.resample(x, up), 10, kernel, {});
        };
        expect_golden_layer(context(), layer);
    };
    each_file("conv", [&](const Golden& golden) {
        for (const char* name : {"c3up", "c3dn", "c1up", "c1dn"}) run(golden, name);
    });
    each_file("lora", [&](const Golden& golden) {
        for (const char* name : {"c3up", "c3dn"}) run(golden, name);
    });
}

/// With the filter [1,3,3,1], which the network does not use but the operators know.
TEST_P(GoldenNetLayers, FilteredConvolutions) {
    each_file("conv", [&](const Golden& golden) {
        for (const std::string name : {"f1331up", "f1331dn"}) {
            const bool up = name.ends_with("up");
            const auto tensor = [&](const std::string& key) {
                return golden_tensor(golden.npz, name + "." + key);
            };
            OpCall resample;
            resample.op = "resample2d";
            resample.attributes = {{"up", up}, {"down", !up}};
            resample.inputs = {tensor("x"), {{4}, {1, 3, 3, 1}}};
            const OpResult middle = run_op(context(), resample);
            ASSERT_OK(middle.status) << name;
            const HostTensor grad_y = tensor("g");
            const Shape between{2, 6, grad_y.shape[2], grad_y.shape[3]};
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

/// Attention between two images as the published code has it, but never uses: one norm for both, keys and
/// values by turns in the channels of one convolution.
TEST_P(GoldenNetLayers, CrossAttention) {
    each_file("norm", [&](const Golden& golden) {
        const auto of = [&](const char* key) { return golden.floats("xatt." + std::string(key)); };
        nn::Graph graph(context());
        std::map<std::string, ValueId> values;
        const auto parameter = [&](const std::string& name, const Shape& shape) {
            return values[name] = graph.parameter(name, shape);
        };
        const ValueId q = graph.input("q", {2, 16, 4, 4});
        const ValueId kv = graph.input("kv", {2, 16, 4, 4});
        const ValueId gamma = parameter("norm.weight", {16});
        const ValueId beta = parameter("norm.bias", {16});
        const auto norm = [&](ValueId x) {
            return graph.op("group_norm", {x, gamma, beta},
                            {{"groups", std::int64_t{4}}, {"eps", 1e-5}});
        };
        const auto conv = [&](const std::string& name, ValueId x, std::uint32_t kernel,
                              ValueId residual = kNoValue) {
            const ValueId weight = parameter(name + ".weight", {16, 16, kernel, kernel});
            return graph.op("conv2d", {x, weight, parameter(name + ".bias", {16}), residual});
        };
        const ValueId asked = norm(kv);
        const ValueId attended = graph.op(
            "attention",
            {conv("q_proj", norm(q), 1), conv("k_proj", asked, 1), conv("v_proj", asked, 1)});
        const ValueId y = conv("out_proj", attended, 3, q);
        ASSERT_OK(graph.status());
        auto run = GraphRun::create(context(), graph, y, {q, kv});
        ASSERT_OK(run.status());
        ASSERT_OK(run.value()->put(q, of("q")));
        ASSERT_OK(run.value()->put(kv, of("kv")));
        /// Rows 2i of kv_proj belong to keys, rows 2i + 1 to values.
        const auto rows = [](const auto& both, std::size_t first) {
            std::remove_cvref_t<decltype(both)> half;
            const std::size_t row = both.size() / 32;
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
            EXPECT_OK(
                run.value()->put(id, half < 0 ? all : rows(all, static_cast<std::size_t>(half))));
        });
        ASSERT_OK(run.value()->run(of("g")));
        expect_relative("y", run.value()->output(), golden.doubles("xatt.y64"), kGoldenLayer);
        const auto gradient = [&](const std::string& what, ValueId id,
                                  const std::vector<double>& expected) {
            if (what == "d.k_proj.bias") {  // which softmax does not see
                EXPECT_LE(norm_of(expected), 1e-12);
                EXPECT_LE(norm_of(to_double(run.value()->gradient(id))), 1e-4);
                return;
            }
            expect_relative(what, run.value()->gradient(id), expected, 1e-4);
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
