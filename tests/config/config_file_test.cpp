#include "config/config_file.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"

namespace splat::test {
namespace {

using config::ModelConfig;

Result<ModelConfig> read_network(const std::string& text) {
    SPLAT_ASSIGN(const Config config, read_config(text, "the test"));
    return config::model_config(config);
}

TEST(ModelConfigFile, ChoosesWhatIsTrained) {
    const auto config =
        need(read_network("opt:\n  freeze: [out.]\n  lora_finetune: true\n  lora_rank: 8\n"
                          "  lora_targets: [conv0]\n  train_with_adapters: [x16_conv., norm]\n"));
    EXPECT_EQ(config.frozen, std::vector<std::string>{"out."});
    EXPECT_EQ(config.lora.rank, 8U);
    EXPECT_EQ(config.lora.targets, std::vector<std::string>{"conv0"});
    EXPECT_EQ(config.lora.trained, (std::vector<std::string>{"x16_conv.", "norm"}));
    const auto plain =
        need(read_network("opt: {freeze: [norm], train_with_adapters: [x16_conv.]}\n"));
    EXPECT_EQ(plain.frozen, std::vector<std::string>{"norm"});
    EXPECT_TRUE(plain.lora.trained.empty()) << "there are no adapters";
    EXPECT_ERROR(read_network("opt: {freeze: 3}\n"), Code::kInvalidArgument, "opt.freeze");
}

/// Configurations that the published code refuses, or for which it builds no network.
TEST(ModelConfigFile, RefusesEmbeddingsWithoutALayer) {
    const auto status = [](const char* embedding) {
        return read_network(std::string("cam_embd: {dimension: 4, ") + embedding + "}\n").status();
    };
    EXPECT_OK(status("embedding: pose, method: film, encode_embedding: positional"));
    EXPECT_OK(status("embedding: pose"));
    EXPECT_OK(status("embedding: null, method: null, encode_embedding: null"));
    EXPECT_OK(status("embedding: null, method: concat, encode_embedding: fourier"));
    EXPECT_ERROR(status("embedding: pose, method: concat"), Code::kInvalidArgument,
                 "'cam_embd.method' is concat, expected film");
    EXPECT_ERROR(status("embedding: index, method: null"), Code::kInvalidArgument,
                 "'cam_embd.method' is null, expected film");
    EXPECT_ERROR(status("embedding: pose, encode_embedding: null"), Code::kInvalidArgument,
                 "'cam_embd.encode_embedding' is null, expected positional");
    EXPECT_ERROR(status("embedding: pose, encode_embedding: fourier"), Code::kInvalidArgument,
                 "'cam_embd.encode_embedding' is fourier, expected positional");
    EXPECT_ERROR(status("method: flim"), Code::kInvalidArgument, "'cam_embd.method' is 'flim'");
    const auto custom = need(read_network(
        "data: {custom_embedding: true}\n"
        "cam_embd: {embedding: pose, dimension: 4, method: film, encode_embedding: null}\n"));
    EXPECT_EQ(custom.embedding, config::Embedding::kCustom);
    EXPECT_ERROR(read_network("data: {custom_embedding: true}\n"), Code::kInvalidArgument,
                 "'cam_embd.embedding' is none, expected pose where data.custom_embedding is true");
}

TEST(ModelConfigFile, TakesOneOfTwoHeads) {
    const auto offset = [](const char* keys) {
        const auto config = read_network(std::string("model: {") + keys + "}\n");
        EXPECT_OK(config);
        return config.ok() && config.value().offset;
    };
    EXPECT_TRUE(offset(""));
    EXPECT_TRUE(offset("network_with_offset: true, network_without_offset: false"));
    EXPECT_TRUE(offset("network_without_offset: false"));
    EXPECT_FALSE(offset("network_with_offset: false"));
    EXPECT_FALSE(offset("network_without_offset: true"));
    EXPECT_FALSE(offset("network_with_offset: false, network_without_offset: true"));
    for (const char* both : {"true", "false"})
        EXPECT_ERROR(read_network(std::string("model: {network_with_offset: ") + both +
                                  ", network_without_offset: " + both + "}\n"),
                     Code::kInvalidArgument, std::string("are both ") + both);
}

/// Adapters of rank 0 would not exist, and all parameters would be trained.
TEST(ModelConfigFile, RefusesAdaptersOfRankZero) {
    EXPECT_ERROR(read_network("opt: {lora_finetune: true, lora_rank: 0}\n"), Code::kInvalidArgument,
                 "'opt.lora_rank' is 0, expected 1 or more");
    EXPECT_OK(read_network("opt: {lora_finetune: false, lora_rank: 0}\n"));
}

/// Reading the output of config_text() gives the same configuration.
TEST(ModelConfigFile, GoesRound) {
    for (const char* text :
         {"{}", "opt: {freeze: ['a \"b\"', norm]}\n",
          "data: {fov: 30.5, use_mask: true, use_pred_plane: true, input_images: 2}\n"
          "cam_embd: {embedding: pose, dimension: 4, film: affine}\n"
          "model: {base_dim: 8, channel_mult: [1, 3], network_without_offset: true}\n"
          "opt: {lora_finetune: true, lora_alpha: 3, train_with_adapters: [x16_conv.]}\n"}) {
        const auto config = need(read_network(text));
        const std::string written = config::config_text(config);
        const auto again = need(read_network(written));
        EXPECT_EQ(config::config_text(again), written) << text;
        EXPECT_EQ(again.frozen, config.frozen);
        EXPECT_EQ(again.plane, config.plane);
        EXPECT_EQ(again.lora.trained, config.lora.trained);
    }
}

}  // namespace
}  // namespace splat::test
