// What a training would leave out, what a resumed run may change, and what a category implies.
#include "config/effects.h"

#include <gtest/gtest.h>

#include "config/config_file.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

Config yaml(const std::string& text) {
    return need(read_yaml_config(text, "test.yaml"));
}

std::vector<std::string> warnings(const std::string& text) {
    return need(config::training_warnings(yaml(text)));
}

TEST(ConfigEffects, KeysWithoutEffectAreNamedWhereTheyAskForSomething) {
    struct Case {
        const char* text;
        const char* key;
    };
    const Case cases[] = {{"general: {mixed_precision: true}", "general.mixed_precision"},
                          {"general: {num_devices: 2}", "general.num_devices"},
                          {"general: {multiple_gpu: true}", "general.multiple_gpu"},
                          {"logging: {loop_log: 10000}", "logging.loop_log"},
                          {"logging: {render_log: 500}", "logging.render_log"},
                          {"opt: {epochs: 3}", "opt.epochs"}};
    for (const Case& c : cases) {
        const auto found = warnings(c.text);
        ASSERT_EQ(found.size(), 1U) << c.text;
        EXPECT_HAS(found[0], c.key);
    }
    EXPECT_EQ(warnings("general: {mixed_precision: false, num_devices: 1, multiple_gpu: false}\n"
                       "opt: {epochs: null, pretrained_hf: null}\nlogging: {loop_log: 0}\n")
                  .size(),
              0U);
    EXPECT_EQ(
        warnings("general: {device: 0}\nmodel: {name: SingleUNet, out_channels: 64}\n").size(), 0U);
}

/// Values that differ from the default, of keys that act only together with another.
TEST(ConfigEffects, KeysThatNeedAnotherAreNamedWithoutIt) {
    struct Case {
        const char* text;
        const char* key;
        const char* complete;
    };
    const Case cases[] = {
        {"opt: {step_lr_at: 5, lr_schedule: constant}",
         "'opt.step_lr_at' has no effect unless opt.lr_schedule is step", "opt: {step_lr_at: 5}"},
        {"opt: {base_lr: 1e-3, stages: [{iterations: 2, base_lr: 1e-4}]}",
         "'opt.base_lr' has no effect because every stage of opt.stages has its own",
         "opt: {base_lr: 1e-3, stages: [{iterations: 2, base_lr: 1e-4}, {iterations: 2}]}"},
        {"opt: {start_lpips_after: 5}", "'opt.start_lpips_after' has no effect while",
         "opt: {start_lpips_after: 5, lambda_lpips: 0.1}"},
        {"opt: {lpips_weights: [a]}", "'opt.lpips_weights' has no effect while",
         "opt: {lpips_weights: [a], lambda_lpips: 0.1}"},
        {"opt: {ema: {use: false, beta: 0.5}}", "'opt.ema.beta' has no effect while opt.ema.use",
         "opt: {ema: {beta: 0.5}}"},
        {"cam_embd: {film: affine}", "'cam_embd.film' has no effect where",
         "cam_embd: {film: affine, embedding: pose}"},
        {"data: {embedding_file: a}", "'data.embedding_file' has no effect without data.custom",
         "data: {embedding_file: a, custom_embedding: true}\ncam_embd: {embedding: pose}"},
        {"data: {tokens_file: a}", "'data.tokens_file' has no effect where model.token_dim is 0",
         "data: {tokens_file: a}\nmodel: {token_dim: 2, tokens: 3}"},
        {"model: {head: f3d, depth_bias: 1}",
         "'model.depth_bias' has no effect unless model.head.positions is ray_depth",
         "model: {depth_bias: 1}"},
        {"model: {head: lgm, depth_scale: 2}", "'model.depth_scale' has no effect unless",
         "model: {depth_scale: 2}"},
        {"model: {head: lgm, network_without_offset: true}",
         "'model.network_without_offset' has no effect where model.head.positions is box",
         "model: {head: f3d, network_without_offset: true}"},
        {"opt: {lora_finetune: false, lora_alpha: 3}", "'opt.lora_alpha' has no effect while",
         "opt: {lora_finetune: true, lora_alpha: 3}"}};
    for (const Case& c : cases) {
        const auto found = warnings(c.text);
        ASSERT_EQ(found.size(), 1U) << c.text;
        EXPECT_HAS(found[0], c.key);
        EXPECT_EQ(warnings(c.complete).size(), 0U) << c.complete;
    }
}

/// The configuration of a run has every value.
TEST(ConfigEffects, WrittenConfigurationsGiveNoWarnings) {
    for (const char* text :
         {"{}", "opt: {ema: {use: false}}", "data: {category: hydrants, excluded_file: a}",
          "opt: {lora_finetune: true}", "cam_embd: {embedding: index}"}) {
        config::Settings settings;
        settings.network = config::model_config(yaml(text)).value();
        settings.training = config::train_config(yaml(text)).value();
        EXPECT_EQ(warnings(config::merged_config_text(settings)).size(), 0U) << text;
    }
}

/// Keys without effect have a type all the same.
TEST(ConfigEffects, KeysWithoutEffectHaveTypes) {
    for (const char* text :
         {"general: {mixed_precision: sometimes}", "general: {num_devices: many}",
          "logging: {loop_log: [1]}", "opt: {epochs: 1.5}", "opt: {pretrained_hf: [true]}"})
        EXPECT_ERROR(config::training_warnings(yaml(text)), Code::kInvalidArgument, ", expected ");
}

TEST(ConfigEffects, AHubIsRefusedWithTheFileToFetch) {
    for (const char* value : {"true", "szymanowiczs/splatter-image-v1"})
        EXPECT_ERROR(config::training_warnings(yaml(std::string("opt: {pretrained_hf: ") + value +
                                                    "}\ndata: {category: hydrants}")),
                     Code::kInvalidArgument, "download model_hydrants.pth");
    EXPECT_ERROR(
        config::training_warnings(yaml("opt: {pretrained_hf: true}\ndata: {category: gso}")),
        Code::kInvalidArgument, "model_latest.pth");
}

TEST(ConfigEffects, ListsThatThePublishedCodeReadsAreMissed) {
    struct Case {
        const char* category;
        const char* list;
    };
    for (const Case& c : {Case{"hydrants", "excluded_file"}, Case{"teddybears", "excluded_file"},
                          Case{"objaverse", "objects_file"}}) {
        const std::string text = std::string("data: {category: ") + c.category;
        const auto found = warnings(text + "}");
        ASSERT_EQ(found.size(), 1U) << c.category;
        EXPECT_HAS(found[0], "'data." + std::string(c.list) + "' is empty");
        EXPECT_EQ(warnings(text + ", " + c.list + ": a}").size(), 0U);
    }
}

TEST(ConfigEffects, VectorsWithoutTheirFileAreRefused) {
    EXPECT_ERROR(config::training_warnings(
                     yaml("data: {custom_embedding: true}\ncam_embd: {embedding: pose}")),
                 Code::kInvalidArgument, "'data.embedding_file' is empty");
    EXPECT_ERROR(config::training_warnings(yaml("model: {token_dim: 2, tokens: 3}")),
                 Code::kInvalidArgument, "'data.tokens_file' is empty");
}

/// A trainer's batches bring them.
TEST(ConfigEffects, VectorsOfTheCallerNeedNoFile) {
    const Config config = yaml("model: {token_dim: 2, tokens: 3}");
    EXPECT_ERROR(config::training_warnings(config), Code::kInvalidArgument, "data.tokens_file");
    EXPECT_OK(config::training_warnings(config, config::VectorsFrom::kCaller));
    EXPECT_ERROR(
        config::training_warnings(yaml("opt: {lora_rank: 8}"), config::VectorsFrom::kCaller),
        Code::kInvalidArgument, "opt.lora_rank");
}

TEST(ConfigEffects, AdaptersWithoutTheirSwitchAreRefused) {
    EXPECT_ERROR(config::training_warnings(yaml("opt: {lora_rank: 8}")), Code::kInvalidArgument,
                 "'opt.lora_rank' is 8, but without opt.lora_finetune there are no adapters");
    const auto found = warnings("opt: {lora_rank: 8, lora_finetune: false}");
    ASSERT_EQ(found.size(), 1U);
    EXPECT_HAS(found[0], "opt.lora_rank");
    EXPECT_EQ(warnings("opt: {lora_rank: 8, lora_finetune: true}").size(), 0U);
}

TEST(ConfigEffects, GraftedChannelsThatCannotLearnAreNamed) {
    const std::string priors = "data: {use_pred_depth: true}\n";
    const auto found = warnings(priors + "opt: {lora_finetune: true}");
    ASSERT_EQ(found.size(), 1U);
    EXPECT_HAS(found[0], "'network_with_offset.encoder.enc.128x128_conv.weight' is not trained");
    EXPECT_HAS(found[0], "opt.train_with_adapters");
    EXPECT_EQ(warnings(priors + "opt: {lora_finetune: true, train_with_adapters: [128x128_conv.]}")
                  .size(),
              0U);
    EXPECT_EQ(warnings(priors + "opt: {lora_finetune: true, lora_targets: [128x128_conv]}").size(),
              0U);
    EXPECT_EQ(warnings(priors).size(), 0U) << "all parameters are trained";
    const auto planes = warnings("data: {use_pred_plane: true}\nopt: {lora_finetune: true}");
    ASSERT_EQ(planes.size(), 1U);
    EXPECT_HAS(planes[0], "mask or planes that are grafted");
    for (const char* freeze : {"{freeze: [128x128_conv]}", "{freeze: [network_with_offset.enc]}",
                               "{freeze: [128x128_conv], lora_finetune: true,\n"
                               "  train_with_adapters: [128x128_conv]}"}) {
        const auto frozen = warnings(priors + "opt: " + freeze);
        ASSERT_EQ(frozen.size(), 1U) << freeze;
        EXPECT_HAS(frozen[0], "opt.freeze");
    }
    EXPECT_EQ(warnings(priors + "opt: {lora_finetune: true, lora_targets: [128x128_conv],\n"
                                "  freeze: [128x128_conv.weight]}")
                  .size(),
              0U)
        << "the adapter of the layer learns";
}

TEST(ConfigEffects, ChangedKeysAreFoundAndSomeMayChange) {
    const auto merged = [](const std::string& text) {
        config::Settings settings;
        const Config read = yaml(text);
        settings.network = config::model_config(read).value();
        settings.training = config::train_config(read).value();
        return read_json_config(config::merged_config_text(settings), "run").value();
    };
    const auto changed = config::changed_keys(
        merged("opt: {iterations: 400}"),
        merged("opt: {iterations: 800, base_lr: 1e-4}\ndata: {use_pred_depth: true}"));
    EXPECT_EQ(changed,
              (std::vector<std::string>{"data.use_pred_depth", "opt.iterations", "opt.base_lr"}));
    EXPECT_EQ(config::changed_keys(merged("{}"), merged("{}")).size(), 0U);
    const Config plain = merged("{}");
    const Config adapted = merged("opt: {lora_finetune: true, lora_rank: 4}");
    EXPECT_EQ(config::changed_keys(plain, adapted).front(), "opt.lora_finetune");
    EXPECT_EQ(config::value_text(plain, "opt.lora_finetune"), "false");
    EXPECT_EQ(config::value_text(adapted, "opt.lora_finetune"), "true");
    EXPECT_EQ(
        config::changed_keys(adapted, merged("opt: {lora_finetune: true, lora_rank: 8}")).front(),
        "opt.lora_rank");
    EXPECT_EQ(config::changed_keys(plain, merged("opt: {freeze: [out.bias]}")),
              (std::vector<std::string>{"opt.freeze"}));
    for (const char* key : {"opt.iterations", "logging.val_log", "data.root", "data.cache_mib"})
        EXPECT_TRUE(config::may_change_on_resume(key)) << key;
    for (const char* key : {"opt.base_lr", "data.use_pred_depth", "general.random_seed", "no.key"})
        EXPECT_FALSE(config::may_change_on_resume(key)) << key;
}

/// A configuration with every value, changed by --set to another category.
TEST(ConfigCategory, ImpliesItsGeometryAlsoOverAnotherOne) {
    const Config base = yaml(
        "data: {category: cars, znear: 0.8, zfar: 1.8, fov: 51.98948897809546,\n"
        "  origin_distances: false, white_background: true, training_resolution: 128}\n"
        "opt: {scale_terms: false}\n");
    const std::vector<std::string> to_hydrants = {"data.category=hydrants"};
    const auto config = need(config::with_values(base, to_hydrants));
    const auto network = need(config::model_config(config));
    const auto training = need(config::train_config(config));
    EXPECT_EQ(network.fov_degrees, 0.0F);
    EXPECT_EQ(network.znear, -2.0F);
    EXPECT_EQ(network.zfar, 2.0F);
    EXPECT_TRUE(network.origin_distance);
    EXPECT_FALSE(training.white_background);
    EXPECT_TRUE(training.scale_terms);

    const std::vector<std::string> kept = {"data.category=hydrants", "data.znear=0.5"};
    EXPECT_EQ(config::model_config(config::with_values(base, kept).value()).value().znear, 0.5F);
    const Config own = yaml("data: {category: cars, zfar: 9}");
    EXPECT_EQ(config::model_config(config::with_values(own, to_hydrants).value()).value().zfar,
              9.0F)
        << "the file's own value stays";
}

TEST(ConfigCategory, AloneGivesItsDefaults) {
    const auto nmr = need(config::model_config(yaml("data: {category: nmr}")));
    EXPECT_EQ(nmr.resolution, 64U);
    EXPECT_EQ(nmr.attention_resolutions, std::vector<std::uint32_t>{8});
    EXPECT_EQ(nmr.zfar, 4.0F);
    const auto other = need(config::model_config(yaml("data: {category: teapots}")));
    EXPECT_EQ(other.zfar, 1.8F) << "an unknown category implies nothing";
}

}  // namespace
}  // namespace splat::test
