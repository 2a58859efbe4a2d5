// Layers that are added to the published network: attention to tokens, adapters of linear layers.
#include <gtest/gtest.h>

#include "model/small_predictor.h"
#include "model/weights.h"

namespace splat::test {
namespace {

class PredictorLayers : public PredictorTest {};
SPLAT_INSTANTIATE_KERNELS(PredictorLayers);

PredictorConfig with_tokens() {
    PredictorConfig config = small_config();
    config.token_dim = 3;
    config.tokens = 5;
    return config;
}

/// In the bottleneck and the decoder's last block of each level with attention, not in the encoder.
TEST_P(PredictorLayers, TokensAreAttendedToInBottleneckAndDecoder) {
    const auto predictor = make(with_tokens());
    ASSERT_TRUE(predictor);
    std::vector<std::string> layers;
    const std::string end = ".cross_attention.q_proj.weight";
    for (const nn::Parameter& parameter : predictor->parameters().all())
        if (parameter.name.ends_with(end))
            layers.push_back(parameter.name.substr(0, parameter.name.size() - end.size()));
    EXPECT_EQ(layers, (std::vector<std::string>{"network_with_offset.encoder.dec.8x8_in0",
                                                "network_with_offset.encoder.dec.8x8_block1"}));
    randomise(*predictor, 120);
    Inputs inputs(with_tokens());
    const std::vector<float> before = run(*predictor, inputs);
    inputs.tokens[4] += 1;
    EXPECT_GT(relative_l2(run(*predictor, inputs), before), 1e-5) << "tokens have an effect";
}

/// Files of networks that attended to tokens in the encoder, too, are taken without that.
TEST_P(PredictorLayers, TokensOfEarlierEncodersAreLeftOut) {
    const auto from = make(with_tokens());
    const auto to = make(with_tokens());
    ASSERT_TRUE(from && to);
    randomise(*from, 130);
    auto state = model::save_state(*from);
    ASSERT_OK(state.status());
    const std::string name =
        "network_with_offset.encoder.enc.8x8_block0.cross_attention.q_proj.weight";
    ASSERT_OK(state.value().add({name, {1}, io::NumberType::kF32, {1}}));
    model::LoadReport report;
    ASSERT_OK(model::load_state(*to, state.value(), {}, report));
    EXPECT_EQ(report.left_out, std::vector<std::string>{name});
    const Inputs inputs(with_tokens());
    EXPECT_EQ(run(*to, inputs), run(*from, inputs));
    ASSERT_OK(state.value().add({"dec.cross_attention.more", {1}, io::NumberType::kF32, {1}}));
    EXPECT_ERROR(model::load_state(*to, state.value(), {}, report), Code::kInvalidArgument,
                 "1 tensors that this network lacks, one is 'dec.cross_attention.more'");
}

}  // namespace
}  // namespace splat::test
