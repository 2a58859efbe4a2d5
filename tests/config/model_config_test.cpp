#include "config/model_config.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/expect_status.h"

namespace splat::test {
namespace {

using config::ModelConfig;

TEST(ModelConfigRules, CountsChannels) {
    ModelConfig c;
    EXPECT_EQ(c.input_channels(), 3U);
    EXPECT_EQ(c.output_channels(), 24U);
    c.depth = c.normal = c.mask = true;
    EXPECT_EQ(c.image_channels(), 8U);
    c.origin_distance = true;
    EXPECT_EQ(c.input_channels(), 9U);
    c.plane = true;
    EXPECT_EQ(c.image_channels(), 13U);
    EXPECT_EQ(c.input_channels(), 14U);
    c.sh_degree = 0;
    EXPECT_EQ(c.output_channels(), 15U);
    c.offset = false;
    EXPECT_EQ(c.output_channels(), 12U);
    c.embedding = config::Embedding::kPose;
    EXPECT_EQ(c.embedding_length(), 60U);
    c.embedding = config::Embedding::kIndex;
    EXPECT_EQ(c.embedding_length(), 10U);
}

/// The heads of Splatter Image, F3D-Gaus and LGM, and one of several Gaussians a pixel.
TEST(ModelConfigRules, HeadsSayWhereTheirChannelsAre) {
    const HeadLayout splatter = ModelConfig().head();
    EXPECT_EQ(splatter.at(kHeadOpacity), 4U);
    EXPECT_EQ(splatter.at(kHeadRest), 15U);
    EXPECT_EQ(splatter.gaussians(2, 128), 2U * 128 * 128);
    EXPECT_FLOAT_EQ(splatter.blocks[kHeadScale].bias, std::log(0.02F));
    EXPECT_FLOAT_EQ(splatter.blocks[kHeadColour].gain, 5);
    const HeadLayout f3d({.positions = kHeadInputDepth});
    EXPECT_EQ(f3d.channels(), 23U);
    EXPECT_EQ(f3d.at(kHeadOpacity), 3U);
    HeadForm form{.positions = kHeadBox, .scales = kHeadSoftplus, .sh_degree = 0, .direct = true};
    const HeadLayout lgm(form);
    EXPECT_EQ(lgm.channels(), 14U);
    EXPECT_EQ(lgm.at(kHeadColour), 11U);
    EXPECT_EQ(lgm.blocks[kHeadPoint].activation, kHeadClamp);
    EXPECT_EQ(lgm.blocks[kHeadColour].activation, kHeadTanh);
    form.per_pixel = 3;
    EXPECT_EQ(HeadLayout(form).channels(), 42U);
    EXPECT_EQ(HeadLayout(form).gaussians(4, 2), 48U);
}

TEST(ModelConfigRules, AcceptsTheDefaults) {
    EXPECT_OK(check(ModelConfig()));
}

TEST(ModelConfigRules, RefusesAndNamesTheField) {
    struct Case {
        const char* part;
        void (*change)(ModelConfig&);
    };
    const Case cases[] = {
        {"'data.training_resolution' is 100, expected a multiple of 8",
         [](ModelConfig& c) { c.resolution = 100; }},
        {"'model.base_dim' is 2, expected 4 to 4096", [](ModelConfig& c) { c.base_dim = 2; }},
        {"'model.num_blocks' is 0", [](ModelConfig& c) { c.num_blocks = 0; }},
        {"'model.channel_mult' has 0 levels", [](ModelConfig& c) { c.channel_mult = {}; }},
        {"'model.channel_mult' is 100, expected no more than 4096 channels",
         [](ModelConfig& c) {
             c.channel_mult = {1, 100};
         }},
        {"'model.max_sh_degree' is 2", [](ModelConfig& c) { c.sh_degree = 2; }},
        {"'data.input_images' is 0", [](ModelConfig& c) { c.views = 0; }},
        {"'data.zfar' is 0.5", [](ModelConfig& c) { c.zfar = 0.5F; }},
        {"'data.fov' is 180, expected 0 to below 180", [](ModelConfig& c) { c.fov_degrees = 180; }},
        {"'model.scale_bias' is 0, expected more than 0",
         [](ModelConfig& c) { c.init_scale.bias = 0; }},
        {"'model.dropout' is 1", [](ModelConfig& c) { c.dropout = 1; }},
        {"'cam_embd.dimension' is 3",
         [](ModelConfig& c) {
             c.embedding = config::Embedding::kPose;
             c.embedding_dim = 3;
         }},
        {"'model.tokens' is 4", [](ModelConfig& c) { c.tokens = 4; }},
        {"'opt.lora_dropout' is -1", [](ModelConfig& c) { c.lora.dropout = -1; }},
    };
    for (const Case& c : cases) {
        ModelConfig config;
        c.change(config);
        EXPECT_ERROR(check(config), Code::kInvalidArgument, c.part);
    }
}

}  // namespace
}  // namespace splat::test
