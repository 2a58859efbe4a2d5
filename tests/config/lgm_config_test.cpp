// The keys of LGM's network, and its configurations.
#include <gtest/gtest.h>

#include "config/config_file.h"
#include "config/effects.h"
#include "config/presets.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using config::ModelConfig;
using config::Network;
using Levels = std::vector<std::uint32_t>;

constexpr const char* kSmallLgm =
    "{network: lgm_unet, head: lgm, down: [32, 64], down_attention: [0, 1], up: [64], "
    "up_attention: [1]}";

Result<ModelConfig> read_lgm(const std::string& yaml) {
    SPLAT_ASSIGN(const Config config, read_yaml_config(yaml, "test.yaml"));
    return config::model_config(config);
}

Result<ModelConfig> changed_lgm(const std::string& change) {
    SPLAT_ASSIGN(const Config base,
                 read_yaml_config(std::string("model: ") + kSmallLgm + "\n", "test.yaml"));
    SPLAT_ASSIGN(const Config config, config::with_values(base, {&change, 1}));
    return config::model_config(config);
}

TEST(LgmConfig, IsReadWrittenAndReadAgain) {
    const ModelConfig c = need(read_lgm(std::string("model: ") + kSmallLgm));
    EXPECT_EQ(c.network, Network::kLgmUnet);
    EXPECT_EQ(c.lgm.down, (Levels{32, 64}));
    EXPECT_EQ(c.output_resolution(), 64U);
    EXPECT_EQ(std::tuple(c.image_channels(), c.input_channels(), c.output_channels()),
              std::tuple(9U, 9U, 14U));
    const std::string text = config::config_text(c);
    const ModelConfig again = need(read_lgm(text));
    EXPECT_EQ(config::config_text(again), text);
    EXPECT_EQ(again.lgm.up_attention, Levels{1});
    const std::string other = config::config_text(ModelConfig());
    for (const char* key : {"network\"", "\"down\"", "\"up\""})
        EXPECT_EQ(other.find(key), std::string::npos) << "earlier configurations do not change";
}

/// 3DTopia/LGM fe8d12c, its options. Splats of a side, and Gaussians of four views.
TEST(LgmConfig, PresetsAreThePublishedOnes) {
    struct Case {
        const char* name;
        std::uint32_t side, gaussians, first, deepest;
        std::size_t down, up;
        std::uint32_t batch, targets;
    };
    for (const Case& p : {Case{"lgm-tiny", 64, 16384, 32, 512, 5, 3, 16, 8},
                          Case{"lgm-small", 64, 16384, 64, 1024, 6, 4, 8, 12},
                          Case{"lgm-big", 128, 65536, 64, 1024, 6, 5, 8, 8}}) {
        SCOPED_TRACE(p.name);
        const auto preset = need(config::preset_of(p.name));
        const Config file = need(read_yaml_config(preset.text, p.name));
        const config::Settings s = need(config::settings_of(file));
        const ModelConfig& n = s.network;
        EXPECT_EQ(std::tuple(n.output_resolution(), n.gaussians(), n.views, n.resolution),
                  std::tuple(p.side, p.gaussians, 4U, 256U));
        EXPECT_EQ(std::tuple(n.lgm.down[0], n.lgm.down.back(), n.lgm.down.size(), n.lgm.up.size()),
                  std::tuple(p.first, p.deepest, p.down, p.up));
        EXPECT_EQ(std::tuple(n.znear, n.zfar, n.fov_degrees, n.opacity_threshold),
                  std::tuple(0.5F, 2.5F, 49.1F, 0.005F));
        EXPECT_EQ(std::tuple(s.training.batch_size, s.training.targets),
                  std::tuple(p.batch, p.targets));
        EXPECT_TRUE(s.training.white_background);
        EXPECT_TRUE(n.direct);
    }
}

TEST(LgmConfig, RefusesWhatItHasNoPlaceFor) {
    const auto refused = [](const char* change, const char* sentence) {
        EXPECT_ERROR(changed_lgm(change), Code::kInvalidArgument, sentence);
    };
    refused("data.use_pred_depth=true", "'data.use_pred_depth' asks for what");
    refused("data.use_mask=true", "'data.use_mask' asks for what");
    refused("data.use_pred_plane=true", "'data.use_pred_plane' asks for what");
    refused("cam_embd.embedding=pose", "'cam_embd.embedding' asks for what");
    refused("opt.lora_finetune=true",
            "'opt.lora_finetune' asks for what 'model.network' lgm_unet does not have");
    refused("model.head.positions=input_depth", "'model.head.positions' asks for what");
    refused("data.fov=0", "'data.fov' is 0, expected more than 0");
    refused("model.down=[32, 48]", "'model.down' is 48, expected multiples of 32, and of 64 with");
    refused("model.down=[32]",
            "'model.down_attention' has 2 levels, expected 1 to 1, as model.down");
    refused("model.up=[64, 32, 32]", "'model.up' has 3 levels, expected 1 to 2");
    refused("model.up=[]", "'model.up' has 0 levels, expected 1 to 2");
    refused("model.down_attention=[0, 2]", "'model.down_attention' is 2, expected 0 to 1");
    refused("data.training_resolution=33", "'data.training_resolution' is 33, expected a multiple");
    refused("model.named_resolution=64", "'model.named_resolution' asks for what");
}

TEST(LgmConfig, WarnsOfKeysOfTheOtherNetwork) {
    const auto warnings = [](const std::string& text) {
        return need(config::training_warnings(need(read_yaml_config(text, "test.yaml"))));
    };
    const std::string keys(kSmallLgm);
    const std::string more = keys.substr(0, keys.size() - 1);
    EXPECT_TRUE(warnings("model: " + keys).empty());
    for (const char* key : {"base_dim: 64", "num_blocks: 2", "inverted_x: true", "dropout: 0.2"}) {
        const auto found = warnings("model: " + more + ", " + key + "}");
        ASSERT_EQ(found.size(), 1U) << key;
        EXPECT_HAS(found[0], "has no effect where model.network is lgm_unet");
    }
    const auto found = warnings("model: {down: [32]}");
    ASSERT_EQ(found.size(), 1U);
    EXPECT_HAS(found[0], "'model.down' has no effect unless model.network is lgm_unet");
}

}  // namespace
}  // namespace splat::test
