// Layers that are added to the published network: attention to tokens, adapters of linear layers.
#include <gtest/gtest.h>

#include "model/adapters.h"
#include "model/small_model.h"
#include "model/weights.h"

namespace splat::test {
namespace {

class ModelLayers : public ModelTest {};
SPLAT_INSTANTIATE_KERNELS(ModelLayers);

ModelConfig with_tokens() {
    ModelConfig config = small_config();
    config.token_dim = 3;
    config.tokens = 5;
    return config;
}

/// In the bottleneck and the decoder's last block of each level with attention, not in the encoder.
TEST_P(ModelLayers, TokensAreAttendedToInBottleneckAndDecoder) {
    const auto model = make(with_tokens());
    std::vector<std::string> layers;
    const std::string end = ".cross_attention.q_proj.weight";
    for (const nn::Parameter& parameter : model->parameters().all())
        if (parameter.name.ends_with(end))
            layers.push_back(parameter.name.substr(0, parameter.name.size() - end.size()));
    EXPECT_EQ(layers, (std::vector<std::string>{"network_with_offset.encoder.dec.8x8_in0",
                                                "network_with_offset.encoder.dec.8x8_block1"}));
    randomise(*model, 120);
    Inputs inputs(with_tokens());
    const std::vector<float> before = run(*model, inputs);
    inputs.tokens[4] += 1;
    EXPECT_GT(relative_l2(run(*model, inputs), before), 1e-5) << "tokens have an effect";
}

/// State dicts whose encoder also attended to tokens are grafted without those layers.
TEST_P(ModelLayers, TokensOfEarlierEncodersAreLeftOut) {
    const auto from = make(with_tokens());
    const auto to = make(with_tokens());
    randomise(*from, 130);
    auto state = need(model::save_state(*from));
    const std::string name =
        "network_with_offset.encoder.enc.8x8_block0.cross_attention.q_proj.weight";
    ASSERT_OK(state.add({name, {1}, io::NumberType::kF32, {1}}));
    model::LoadReport report;
    EXPECT_ERROR(model::load_state(*to, state, {}, report), Code::kInvalidArgument,
                 name +
                     "'; networks of earlier versions also attended to tokens in the encoder: "
                     "graft the file to leave that out");
    model::LoadOptions graft;
    graft.graft = true;
    ASSERT_OK(model::load_state(*to, state, graft, report));
    EXPECT_EQ(report.left_out, std::vector<std::string>{name});
    const Inputs inputs(with_tokens());
    EXPECT_EQ(run(*to, inputs), run(*from, inputs));
    ASSERT_OK(state.add({"dec.cross_attention.more", {1}, io::NumberType::kF32, {1}}));
    EXPECT_ERROR(model::load_state(*to, state, {}, report), Code::kInvalidArgument,
                 "2 tensors that this network lacks, one is 'dec.cross_attention.more'");
}

ModelConfig adapted_linear(std::uint32_t rank) {
    ModelConfig config = small_config();
    config.embedding = model::Embedding::kCustom;
    config.embedding_dim = 2;
    config.lora.rank = rank;
    config.lora.alpha = 6;
    config.lora.targets = {"affine", "map_layer"};
    return config;
}

/// Adapters of linear layers add scale * B (A x): the outputs are those of merged weights, the gradients
/// those of the chain rule through W + scale * B A.
TEST_P(ModelLayers, LinearLayersTakeAdapters) {
    constexpr std::uint32_t kRank = 3;
    constexpr double kScale = 6.0 / kRank;
    ModelOptions options;
    options.gradients = true;
    const auto adapted = make(adapted_linear(kRank), options);
    const auto merged = make(adapted_linear(0), options);
    randomise(*adapted, 140);
    const auto file = need(model::save_adapters(*adapted));
    const std::string prefix = "network_with_offset.encoder.";
    const io::NamedTensor* a =
        file.tensors.find("base_model.model." + prefix + "enc.8x8_block0.affine.lora_A.weight");
    ASSERT_NE(a, nullptr);
    EXPECT_EQ(a->dims, (std::vector<std::int64_t>{kRank, 32}));

    const auto state = need(model::save_state(*adapted));
    const auto folded = need(model::merge_adapters(state, file.tensors, 6, 1));
    model::LoadReport report;
    ASSERT_OK(model::load_state(*merged, folded, {}, report));
    ASSERT_OK(model::load_adapters(*adapted, file, report));

    Inputs inputs(adapted_linear(kRank));
    const std::vector<float> embedding = normal_fill(12, 150);
    const auto pass = [&](Model& model) {
        model::ModelInput input = inputs.view();
        input.embedding = embedding;
        EXPECT_OK(model.set_input(input));
        EXPECT_OK(model.forward());
        const auto gradients = model.output_gradients().value();
        std::uint64_t seed = 160;
        for (const vk::BufferView& view : {gradients.means, gradients.opacities, gradients.scales,
                                           gradients.rotations, gradients.sh}) {
            const std::vector<float> values = normal_fill(view.shape.elements(), seed++);
            EXPECT_OK(context().write(view, values.data(), values.size() * 4));
        }
        EXPECT_OK(model.backward());
        return read(model.raw_output());
    };
    EXPECT_LE(relative_l2(pass(*adapted), pass(*merged)), 1e-5)
        << "float32 sums of the same numbers in another order";

    for (const char* layer :
         {"map_layer0", "map_layer1", "enc.16x16_block0.affine", "dec.8x8_in0.affine"}) {
        const auto value = [&](Model& of, const char* end, bool gradient) {
            const nn::Parameter* p = of.parameters().find(prefix + layer + end);
            return p == nullptr ? std::vector<float>() : read(gradient ? p->grad : p->value);
        };
        const std::vector<float> down = value(*adapted, ".lora_A", false);
        const std::vector<float> up = value(*adapted, ".lora_B", false);
        const std::vector<float> grad = value(*merged, ".weight", true);
        const std::size_t out = up.size() / kRank;
        const std::size_t in = down.size() / kRank;
        ASSERT_EQ(grad.size(), out * in) << layer;
        std::vector<float> grad_down(down.size());
        std::vector<float> grad_up(up.size());
        for (std::size_t r = 0; r < kRank; ++r)
            for (std::size_t o = 0; o < out; ++o)
                for (std::size_t i = 0; i < in; ++i) {
                    const double g = kScale * static_cast<double>(grad[o * in + i]);
                    grad_down[r * in + i] +=
                        static_cast<float>(g * static_cast<double>(up[o * kRank + r]));
                    grad_up[o * kRank + r] +=
                        static_cast<float>(g * static_cast<double>(down[r * in + i]));
                }
        // Deep networks of random weights amplify rounding; a wrong factor would be off by half.
        EXPECT_LE(relative_l2(value(*adapted, ".lora_A", true), grad_down), 1e-4) << layer;
        EXPECT_LE(relative_l2(value(*adapted, ".lora_B", true), grad_up), 1e-4) << layer;
    }
}

/// Adapters of linear layers also start without effect, and leave the weights of the layer unchanged.
TEST_P(ModelLayers, LinearAdaptersStartWithoutEffect) {
    const auto adapted = make(adapted_linear(2));
    const auto plain = make(adapted_linear(0));
    Inputs inputs(adapted_linear(0));
    const std::vector<float> embedding = normal_fill(12, 150);
    const auto predict = [&](Model& model) {
        model::ModelInput input = inputs.view();
        input.embedding = embedding;
        EXPECT_OK(model.set_input(input));
        EXPECT_OK(model.forward());
        return read(model.raw_output());
    };
    EXPECT_EQ(predict(*adapted), predict(*plain));
    for (const nn::Parameter& parameter : adapted->parameters().all())
        EXPECT_EQ(parameter.trainable, parameter.name.find(".lora_") != std::string::npos)
            << parameter.name;
}

}  // namespace
}  // namespace splat::test
