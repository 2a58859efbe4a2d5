// Networks that no golden file holds, against the same graph in float64: with affine modulation, modulation
// and adapters, attention to tokens, and without offsets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "model/adam_steps.h"
#include "model/adapters.h"
#include "model/graph_reference.h"
#include "model/small_model.h"
#include "model/song_unet.h"
#include "ops/op_harness.h"
#include "support/golden_file.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using nn::kNoValue;
using nn::ValueId;

/// 2 levels of 8 and 4 pixels, attention at 4: every kind of block, and a float64 pass of 50 ms.
ModelConfig tiny_config() {
    ModelConfig c = small_config();
    c.resolution = 8;
    c.attention_resolutions = {4};
    return c;
}

struct NetworkCase {
    const char* name;
    ModelConfig config;
};

std::vector<NetworkCase> network_cases() {
    std::vector<NetworkCase> cases;
    const auto add = [&](const char* name, const auto& change) {
        cases.push_back({name, tiny_config()});
        change(cases.back().config);
    };
    const auto modulated = [](ModelConfig& c, model::Film film) {
        c.embedding = model::Embedding::kCustom;
        c.embedding_dim = 2;
        c.film = film;
    };
    add("affine", [&](ModelConfig& c) { modulated(c, model::Film::kAffine); });
    add("affine and adapters", [&](ModelConfig& c) {
        modulated(c, model::Film::kAffine);
        c.lora.rank = 3;
        c.lora.alpha = 6;
        c.lora.trained = {"affine", "map_layer", "norm1"};
    });
    add("shifts and adapters, also of the first convolution", [&](ModelConfig& c) {
        modulated(c, model::Film::kReference);
        c.depth = c.normal = true;
        c.lora.rank = 2;
        c.lora.targets.emplace_back("8x8_conv");
        c.lora.trained = {"affine"};
    });
    add("tokens", [](ModelConfig& c) {
        c.tokens = 5;
        c.token_dim = 7;
    });
    add("no offset, two views, everything at once", [&](ModelConfig& c) {
        modulated(c, model::Film::kAffine);
        c.offset = false;
        c.views = 2;
        c.mask = true;
        c.tokens = 3;
        c.token_dim = 4;
        c.lora.rank = 2;
        c.lora.trained = {"cross_attention", "affine"};
    });
    return cases;
}

/// The network of a configuration for two objects. Its parameters keep the activations of every layer
/// near 1.
class Network {
  public:
    Network(vk::Context& context, const ModelConfig& config)
        : graph(context), unet_(graph, config, strict()) {
        const std::uint32_t n = 2 * config.views;
        const auto input = [&](const char* name, const Shape& shape) {
            inputs.push_back(graph.input(name, shape));
            return inputs.back();
        };
        const ValueId x =
            input("x", {n, config.image_channels(), config.resolution, config.resolution});
        const std::uint32_t length = config.embedding_length();
        const ValueId embedding = length == 0 ? kNoValue : input("embedding", {n, length});
        const ValueId tokens = config.tokens == 0
                                   ? kNoValue
                                   : input("tokens", {n, config.token_dim, config.tokens, 1});
        output = unet_.build(x, embedding, tokens, kNoValue);
    }

    /// Numbers of an input or a parameter.
    [[nodiscard]] std::vector<float> numbers(ValueId id) const {
        const nn::Value& value = graph.value(id);
        const std::size_t count = value.shape.elements();
        if (value.name.ends_with("bias")) return normal_fill(count, 500 + id, 0, 0.3);
        if (value.kind == nn::ValueKind::kInput) return normal_fill(count, 500 + id);
        if (value.shape.rank() == 1) return normal_fill(count, 500 + id, 1, 0.2);  // a norm
        const double terms = static_cast<double>(count) / value.shape[0];
        return normal_fill(count, 500 + id, 0, 1 / std::sqrt(terms));
    }

    /// Inputs and parameters.
    [[nodiscard]] std::vector<ValueId> leaves() const {
        std::vector<ValueId> all;
        for (ValueId id = 0; id < graph.values().size(); ++id)
            if (graph.value(id).kind != nn::ValueKind::kActivation &&
                graph.value(id).base == kNoValue)
                all.push_back(id);
        return all;
    }

    /// True if a gradient is wanted.
    [[nodiscard]] bool trains(ValueId id) const {
        return graph.value(id).kind == nn::ValueKind::kInput || graph.value(id).trainable;
    }

    nn::Graph graph;
    std::vector<ValueId> inputs;
    ValueId output = kNoValue;

  private:
    static model::BuildOptions strict() {
        model::BuildOptions options{.precision = model::Precision::kStrict};
        return options;
    }
    model::SongUnet unet_;
};

class Networks : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Networks);

/// Some 25 layers with the errors of single operators, 1e-6 to 5e-6 (tolerances.h), which mostly do not
/// add up; gradients go through all of them twice. The figures of whole golden networks are 1e-4.
constexpr double kNetworkOutput = 1e-5;
constexpr double kNetworkGradient = 5e-5;

/// The bias of keys adds the same to all scores of a query: softmax does not see it.
bool without_effect(const std::string& name) {
    return name.ends_with("k_proj.bias");
}

TEST_P(Networks, OutputsAndGradientsMatchFloat64) {
    for (const NetworkCase& c : network_cases()) {
        SCOPED_TRACE(c.name);
        const Network network(context(), c.config);
        ASSERT_OK(network.graph);
        auto gpu = need(GraphRun::create(context(), network.graph, network.output, network.inputs));
        GraphReference reference(network.graph);
        for (const ValueId id : network.leaves()) {
            const std::vector<float> numbers = network.numbers(id);
            reference.put(id, to_double(numbers));
            ASSERT_OK(gpu->put(id, numbers));
        }
        const std::vector<float> grad =
            normal_fill(network.graph.value(network.output).shape.elements(), 9);
        ASSERT_OK(gpu->run(grad));
        reference.forward();
        expect_relative("output", gpu->output(), reference.value(network.output), kNetworkOutput);
        reference.backward(network.output, to_double(grad));
        for (const ValueId id : network.leaves()) {
            if (!network.trains(id)) continue;
            const std::string& name = network.graph.value(id).name;
            if (without_effect(name)) {
                EXPECT_LE(norm_of(reference.gradient(id)), 1e-10) << name;
                EXPECT_LE(norm_of(to_double(gpu->gradient(id))), 1e-4) << name;
            } else {
                expect_relative(name, gpu->gradient(id), reference.gradient(id), kNetworkGradient);
            }
        }
    }
}

/// The float64 network's gradients agree with central differences of its outputs, along one direction
/// through all parameters and inputs.
TEST(NetworksReference, GradcheckFloat64) {
    vk::Context* context = shared_context();
    for (const NetworkCase& c : network_cases()) {
        SCOPED_TRACE(c.name);
        const Network network(*context, c.config);
        ASSERT_OK(network.graph);
        const std::vector<double> grad =
            to_double(normal_fill(network.graph.value(network.output).shape.elements(), 9));
        GraphReference reference(network.graph);
        const auto loss = [&](double step) {
            for (const ValueId id : network.leaves()) {
                std::vector<double> numbers = to_double(network.numbers(id));
                const std::vector<float> direction = normal_fill(numbers.size(), 9000 + id);
                for (std::size_t i = 0; i < numbers.size(); ++i)
                    numbers[i] += step * static_cast<double>(direction[i]);
                reference.put(id, numbers);
            }
            reference.forward();
            double sum = 0;
            for (std::size_t i = 0; i < grad.size(); ++i)
                sum += grad[i] * reference.value(network.output)[i];
            return sum;
        };
        const double step = 2e-6;  // a step of about 10^4 numbers together
        const double difference = (loss(step) - loss(-step)) / (2 * step);
        loss(0);
        reference.backward(network.output, grad);
        double slope = 0;
        for (const ValueId id : network.leaves()) {
            const std::vector<float> direction = normal_fill(network.numbers(id).size(), 9000 + id);
            for (std::size_t i = 0; i < direction.size(); ++i)
                slope += static_cast<double>(direction[i]) * reference.gradient(id)[i];
        }
        EXPECT_NEAR(difference, slope, 1e-6 * std::abs(slope) + 1e-6);
    }
}

/// Images before a camera at the origin.
struct ImageInputs {
    explicit ImageInputs(const ModelConfig& c)
        : images(normal_fill(std::size_t{c.input_channels()} * c.resolution * c.resolution, 5)),
          tokens(normal_fill(std::size_t{c.token_dim} * c.tokens, 6)),
          embedding(normal_fill(c.embedding_length(), 7)) {}
    [[nodiscard]] model::ModelInput view() const {
        return {.images = images,
                .view_to_world = pose,
                .quaternions = rotation,
                .focals = {},
                .embedding = embedding,
                .tokens = tokens};
    }
    std::vector<float> images, tokens, embedding;
    std::vector<float> pose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    std::vector<float> rotation = {1, 0, 0, 0};
};

/// Whole models, with gradients.
class NetworksTraining : public ModelTest {
  protected:
    std::unique_ptr<Model> make(const ModelConfig& config) {
        ModelOptions options;
        options.gradients = true;
        options.build.precision = model::Precision::kStrict;
        return ModelTest::make(config, options);
    }
    void randomise(Model& model, std::uint64_t seed) {
        for (const nn::Parameter& parameter : model.parameters().all())
            EXPECT_OK(model.parameters().write(
                parameter, normal_fill(parameter.shape.elements(), ++seed, 0, 0.2)));
    }
    std::vector<float> means(Model& model, const ImageInputs& inputs) {
        EXPECT_OK(model.set_input(inputs.view()));
        EXPECT_OK(model.forward());
        return read(model.outputs().value().means);
    }
};
INSTANTIATE_TEST_SUITE_P(Kernels, NetworksTraining, testing::Values(vk::Kernels::kCpu),
                         kernels_test_name);

/// The name, in a network with offsets, of a parameter of one without.
std::string with_offset(const std::string& name) {
    const std::string without = "network_wo_offset";
    EXPECT_TRUE(name.starts_with(without)) << name;
    return "network_with_offset" + name.substr(without.size());
}

/// The weights that lead to the offsets, with zeros put in or taken out: rows 1 to 3, in the last layer
/// also columns.
std::vector<float> offset_channels(const std::string& name, const std::vector<float>& values,
                                   std::size_t channels, bool put_in) {
    const bool last = name == "network_with_offset.out.weight";
    if (!last && name != "network_with_offset.out.bias" && name.find("aux_conv") == name.npos)
        return values;
    const std::size_t row = values.size() / channels;
    const std::size_t wider = channels + (put_in ? 3 : 0);
    std::vector<float> result;
    std::size_t from = 0;
    for (std::size_t r = 0; r < wider; ++r)
        for (std::size_t c = 0; c < (last ? wider : row); ++c) {
            const bool offset = (r >= 1 && r < 4) || (last && c >= 1 && c < 4);
            if (put_in) {
                result.push_back(offset ? 0.0F : values[from++]);
            } else if (!offset) {
                result.push_back(values[r * row + c]);
            }
        }
    return result;
}

/// A network without offsets predicts and learns the same as one whose offsets are zero.
TEST_P(NetworksTraining, WithoutOffsets) {
    ModelConfig config = tiny_config();
    config.offset = false;
    const auto without = make(config);
    config.offset = true;
    const auto with = make(config);
    randomise(*without, 60);
    for (const nn::Parameter& parameter : without->parameters().all())
        ASSERT_OK(with->parameters().write(
            *with->parameters().find(with_offset(parameter.name)),
            offset_channels(with_offset(parameter.name), read(parameter.value), 21, true)));
    const ImageInputs inputs(config);
    expect_relative("means", means(*with, inputs), to_double(means(*without, inputs)), 1e-6);
    const std::vector<float> grad = normal_fill(3 * 64, 3);
    for (Model* model : {without.get(), with.get()}) {
        const auto gradients = model->output_gradients().value();
        for (const vk::BufferView& view :
             {gradients.opacities, gradients.scales, gradients.rotations, gradients.sh})
            ASSERT_OK(context().fill(view, 0));
        ASSERT_OK(context().write(gradients.means, grad.data(), grad.size() * 4));
        ASSERT_OK(model->backward());
    }
    for (const nn::Parameter& parameter : without->parameters().all()) {
        const std::vector<float> wide =
            read(with->parameters().find(with_offset(parameter.name))->grad);
        const std::vector<float> narrow = read(parameter.grad);
        expect_relative(parameter.name,
                        offset_channels(with_offset(parameter.name), wide, 24, false),
                        to_double(narrow), 1e-5);
    }
}

/// gamma * norm(x) + beta is the norm with other weights: a network without modulation gets those weights
/// and predicts the same as one whose modulation is equal for all embeddings.
TEST_P(NetworksTraining, AffineModulationIsThatOfTheNorm) {
    ModelConfig config = tiny_config();
    const auto plain = make(config);
    config.embedding = model::Embedding::kCustom;
    config.embedding_dim = 2;
    config.film = model::Film::kAffine;
    const auto modulated = make(config);
    randomise(*modulated, 200);
    std::size_t blocks = 0;
    for (const nn::Parameter& parameter : plain->parameters().all()) {
        const nn::Parameter& same = *modulated->parameters().find(parameter.name);
        std::vector<float> values = read(same.value);
        const std::size_t at = parameter.name.find("norm1.");
        if (at != std::string::npos) {
            const std::string affine = parameter.name.substr(0, at) + "affine.";
            const nn::Parameter& weight = *modulated->parameters().find(affine + "weight");
            ASSERT_OK(modulated->parameters().write(
                weight, std::vector<float>(weight.shape.elements(), 0)));
            const std::vector<float> modulation =
                read(modulated->parameters().find(affine + "bias")->value);
            ASSERT_EQ(modulation.size(), 2 * values.size());
            const bool bias = parameter.name.ends_with("bias");
            for (std::size_t i = 0; i < values.size(); ++i)
                values[i] =
                    modulation[i] * values[i] + (bias ? modulation[values.size() + i] : 0.0F);
            ++blocks;
        }
        ASSERT_OK(plain->parameters().write(parameter, values));
    }
    EXPECT_EQ(blocks, 2U * 10) << "weight and bias of every block";
    const ImageInputs inputs(config);
    const std::vector<float> expected = means(*plain, ImageInputs(plain->config()));
    expect_relative("means", means(*modulated, inputs), to_double(expected), 1e-5);
}

/// With either modulation, folded adapters predict the same as separate ones.
TEST_P(NetworksTraining, FoldedAdaptersOfAModulatedNetwork) {
    for (const model::Film film : {model::Film::kReference, model::Film::kAffine}) {
        ModelConfig config = tiny_config();
        config.embedding = model::Embedding::kCustom;
        config.embedding_dim = 2;
        config.film = film;
        const auto folded = make(config);
        config.lora.rank = 3;
        config.lora.alpha = 6;
        config.lora.targets.emplace_back("8x8_conv");
        const auto adapted = make(config);
        randomise(*adapted, 300);
        const auto state = need(model::save_state(*adapted));
        const ImageInputs inputs(config);
        const std::vector<double> expected = to_double(means(*adapted, inputs));
        model::LoadReport report;
        for (const int times : {1, 0}) {
            const auto merged =
                need(model::merge_adapters(state, state, 6 * static_cast<float>(times), 1));
            ASSERT_OK(model::load_state(*folded, merged, {}, report));
            const std::vector<float> got = means(*folded, inputs);
            if (times == 1) {
                expect_relative("means", got, expected, 1e-5);
            } else {
                double difference = 0;
                for (std::size_t i = 0; i < got.size(); ++i)
                    difference =
                        std::max(difference, std::abs(static_cast<double>(got[i]) - expected[i]));
                EXPECT_GT(difference, 1e-2) << "without them";
            }
        }
    }
}

/// Attention to tokens starts without effect; after some steps all of its weights have moved, and the
/// tokens matter.
TEST_P(NetworksTraining, LearnsToAttend) {
    ModelConfig config = tiny_config();
    config.tokens = 5;
    config.token_dim = 7;
    const auto model = make(config);
    const ImageInputs inputs(config);
    ImageInputs others = inputs;
    for (float& token : others.tokens) token = -token;
    const std::vector<float> first = means(*model, inputs);
    EXPECT_EQ(means(*model, others), first);
    const auto weights = [&] {
        std::map<std::string, std::vector<float>> all;
        for (const nn::Parameter& parameter : model->parameters().all())
            if (parameter.name.find("cross_attention") != std::string::npos &&
                !without_effect(parameter.name))
                all[parameter.name] = read(parameter.value);
        return all;
    };
    const auto before = weights();
    EXPECT_EQ(before.size(), 9U * 2)
        << "norm, q, k, v, out of bottleneck and decoder, except the keys' bias";
    AdamSteps adam(context(), *model);
    adam.run(5, inputs.view());
    if (testing::Test::HasFatalFailure()) return;
    for (const auto& [name, values] : weights()) {
        std::vector<double> moved;
        for (std::size_t i = 0; i < values.size(); ++i)
            moved.push_back(static_cast<double>(values[i]) -
                            static_cast<double>(before.at(name)[i]));
        // Adam's steps are of the size of its rate, 1e-3, for each element.
        EXPECT_GT(norm_of(moved), 1e-3 * std::sqrt(static_cast<double>(moved.size()))) << name;
    }
    EXPECT_NE(means(*model, others), means(*model, inputs));
}

}  // namespace
}  // namespace splat::test
