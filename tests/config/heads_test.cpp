#include "config/heads.h"

#include <gtest/gtest.h>

#include "config/config_file.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using config::Head;
using config::ModelConfig;
using config::Settings;

Result<ModelConfig> read(const std::string& yaml) {
    SPLAT_ASSIGN(const Config config, read_yaml_config(yaml, "test.yaml"));
    return config::model_config(config);
}

/// The network of a configuration with one value changed.
ModelConfig changed(const ModelConfig& network, const std::string& change) {
    const Config config = need(read_config(config::merged_config_text({network, {}}), "merged"));
    return need(config::model_config(need(config::with_values(config, {&change, 1}))));
}

void expect_same_head(const ModelConfig& a, const ModelConfig& b) {
    EXPECT_EQ(config::config_text(a), config::config_text(b));
    EXPECT_EQ(a.head().channels(), b.head().channels());
}

TEST(Heads, AreFoundByTheirNames) {
    for (const Head& head : config::kHeads) {
        SCOPED_TRACE(head.name);
        const ModelConfig network = need(read(std::string("model: {head: ") + head.name + "}"));
        EXPECT_EQ(network.head_name, head.name);
        ModelConfig taken;
        config::take_head(head, taken);
        expect_same_head(network, taken);
        EXPECT_EQ(network.opacity_threshold, head.opacity_threshold);
        expect_same_head(network,
                         need(read(std::string("model: {head: {like: ") + head.name + "}}")));
        // What is written says all of it.
        expect_same_head(
            network,
            need(config::model_config(need(read_config(config::config_text(network), "written")))));
        expect_same_head(changed(network, "model.head=splatter"), ModelConfig());
        expect_same_head(changed(ModelConfig(), std::string("model.head=") + head.name), network);
        expect_same_head(changed(ModelConfig(), std::string("model.head.like=") + head.name),
                         network);
    }
    EXPECT_EQ(need(read("{}")).head().channels(), 24U);
    EXPECT_EQ(need(read("model: {head: f3d}")).head().channels(), 23U);
    EXPECT_EQ(need(read("model: {head: lgm}")).head().channels(), 14U);
}

TEST(Heads, TakeTheKeysBelowThem) {
    const ModelConfig network = need(
        read("model: {opacity_bias: -1, head: {like: lgm, box: 2, per_pixel: 3, scales: exp}}"));
    EXPECT_EQ(network.box, 2);
    EXPECT_EQ(network.head().channels(), 42U);
    EXPECT_EQ(network.head().blocks[kHeadScale].activation, kHeadExp);
    EXPECT_EQ(network.head().least, -2);
    EXPECT_EQ(network.init_opacity.bias, -1);
    EXPECT_EQ(network.head_name, "lgm") << "although its scales are another's";
    expect_same_head(
        network,
        need(config::model_config(need(read_config(config::config_text(network), "written")))));
    // A value that a row does not have is written, even where it is that of the first row.
    const ModelConfig all = need(read("model: {head: {like: lgm, opacity_threshold: 0}}"));
    EXPECT_EQ(need(config::model_config(need(read_config(config::config_text(all), "written"))))
                  .opacity_threshold,
              0);
    // What the user has chosen stays where the head changes.
    EXPECT_EQ(changed(network, "model.head=f3d").init_opacity.bias, -1);
    EXPECT_FALSE(need(read("model: {head: lgm, network_without_offset: true}")).offset);
}

TEST(Heads, AreNotWrittenWhereTheyAreOfEarlierConfigurations) {
    EXPECT_EQ(config::config_text(ModelConfig()).find("head"), std::string::npos);
    EXPECT_EQ(config::config_text(ModelConfig()).find("named_resolution"), std::string::npos);
    ModelConfig named;
    named.named_resolution = 64;
    EXPECT_NE(config::config_text(named).find("\"named_resolution\": 64"), std::string::npos);
}

TEST(Heads, StartScalesWhereTheyAreAsked) {
    ModelConfig c = need(read("model: {head: lgm}"));
    EXPECT_NEAR(c.head().blocks[kHeadScale].bias, 0, 1e-6);
    for (const float scale : {1e-4F, 0.03F, 20.0F}) {
        c.init_scale.bias = scale;
        const auto x = static_cast<double>(c.head().blocks[kHeadScale].bias);
        const double back = x > 50 ? x / 10 : std::log1p(std::exp(x)) / 10;
        EXPECT_NEAR(back / static_cast<double>(scale), 1, 1e-5);
    }
}

TEST(Heads, RefuseWhatDoesNotGoTogether) {
    const auto refused = [](const char* yaml, const char* sentence) {
        EXPECT_ERROR(read(yaml), Code::kInvalidArgument, sentence);
    };
    refused("model: {head: lmg}", "'model.head' is 'lmg', expected one of splatter, f3d, lgm");
    refused("model: {head: {like: x}}", "'model.head.like' is 'x', expected one of splatter");
    refused("model: {head: {positions: ray}}",
            "'model.head.positions' is 'ray', expected one of ray_depth, input_depth, box");
    refused("model: {head: {boxes: 1}}", "head.boxes'; did you mean");
    refused("model: {head: {box: 0}}", "'model.head.box' is 0, expected more than 0");
    refused("model: {head: {per_pixel: 5}}", "'model.head.per_pixel' is 5, expected 1 to 4");
    refused("model: {head: lgm, max_sh_degree: 1}",
            "'model.max_sh_degree' is 1, expected 0, as 'model.head.colours' are direct");
    refused("{data: {origin_distances: true}, model: {head: f3d}}",
            "'data.origin_distances' is 1, expected false");
    refused("model: {named_resolution: 100}",
            "'model.named_resolution' is 100, expected 0 or a multiple of 8");
}

/// All that another head takes is a row.
TEST(Heads, AreOneRowMore) {
    constexpr Head kMine[] = {config::kHeads[0],
                              {"mine",
                               {.scales = kHeadSoftplus, .per_pixel = 2},
                               {2, 0},
                               {1, 0},
                               {1, -1},
                               {1, 0.03F},
                               0.1F}};
    const Config config = need(read_yaml_config("model: {head: mine}", "test.yaml"));
    const ModelConfig network = need(config::model_config(config, kMine));
    EXPECT_EQ(network.output_channels(), 48U);
    EXPECT_EQ(network.init_depth.scale, 2);
    EXPECT_EQ(network.opacity_threshold, 0.1F);
}

}  // namespace
}  // namespace splat::test
