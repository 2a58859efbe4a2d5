// Configurations with the keys and values of the files of Splatter Image and of its fork with
// priors, as Hydra merges them.
#include <gtest/gtest.h>

#include "config/config_file.h"
#include "config/effects.h"
#include "config/train_config.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

constexpr double kCarsFov = 51.98948897809546;

/// The defaults under the file of each data set. `fov`: the default of the original has it, that of
/// the fork does not.
std::string defaults(bool fov) {
    return std::string(
               "general: {device: 0, random_seed: 0, num_devices: 1, mixed_precision: false}\n"
               "cam_embd: {embedding: null, encode_embedding: null, dimension: 0, method: null}\n"
               "opt: {iterations: 800001, base_lr: 0.00005, batch_size: 8, betas: [0.9, 0.999],\n"
               "  loss: l2, imgs_per_obj: 4, lambda_lpips: 0.0, pretrained_ckpt: null,\n"
               "  ema: {use: true, update_every: 10, update_after_step: 100, beta: 0.9999}}\n"
               "model: {max_sh_degree: 1, inverted_x: false, inverted_y: true, name: SingleUNet,\n"
               "  opacity_scale: 1.0, opacity_bias: -2.0, scale_bias: 0.02, scale_scale: 0.003,\n"
               "  xyz_scale: 0.1, xyz_bias: 0.0, depth_scale: 1.0, depth_bias: 0.0,\n"
               "  network_without_offset: false, network_with_offset: true, num_blocks: 4,\n"
               "  attention_resolutions: [16], cross_view_attention: true, base_dim: 128,\n"
               "  isotropic: false, out_channels: 64}\n"
               "logging: {ckpt_iterations: 1000, val_log: 10000, loss_log: 10, loop_log: 10000,\n"
               "  render_log: 10000}\n"
               "data: {training_resolution: 128, subset: -1, input_images: 1,\n"
               "  origin_distances: false") +
           (fov ? ", fov: 51.98948897809546}\n" : "}\n");
}

Result<config::Settings> merge(const std::string& base, const std::string& over) {
    SPLAT_ASSIGN(Config config, read_yaml_config(base, "merged.yaml"));
    SPLAT_ASSIGN(const Config changes, read_yaml_config(over, "data set"));
    for (const ConfigEntry& entry : changes.entries())
        if (!entry.map) config.set(entry);
    config::Settings made;
    SPLAT_ASSIGN(made.network, config::model_config(config));
    SPLAT_ASSIGN(made.training, config::train_config(config));
    return made;
}

/// Keys of published files that have no effect are named; nothing is refused.
TEST(TrainConfigPublished, LoadWithWarningsOnly) {
    const auto config = need(read_yaml_config(defaults(true), "merged.yaml"));
    const std::string objaverse[] = {"general.num_devices=2",   "general.mixed_precision=true",
                                     "data.category=objaverse", "data.objects_file=lvis.json",
                                     "opt.lora_finetune=false", "opt.lora_rank=4"};
    const auto warnings =
        need(config::training_warnings(config::with_values(config, objaverse).value()));
    std::string named;
    for (const std::string& warning : warnings)
        named += warning.substr(0, warning.find(" has no")) + "\n";
    EXPECT_EQ(named,
              "merged.yaml: 'opt.lora_rank'\nmerged.yaml: 'logging.render_log'\n"
              "merged.yaml: 'logging.loop_log'\nmerged.yaml: 'general.mixed_precision'\n"
              "merged.yaml: 'general.num_devices'\n");
}

/// Keys of the trainer that made the released weights. A step without a schedule means the schedule step; -1 none.
TEST(TrainConfigPublished, OlderKeysMeanWhatTheyMeant) {
    const auto made = [](const std::string& opt) {
        return need(merge(defaults(true), "opt: {" + opt + "}\n")).training;
    };
    const config::TrainConfig cars =
        made("lambda_lpips: 0.01, start_lpips_after: 800001, step_lr_at: 800001");
    EXPECT_EQ(cars.schedule, config::Schedule::kStep);
    EXPECT_EQ(cars.rate(800000), 5e-5);
    EXPECT_EQ(cars.rate(800001), 5e-5 / 10);
    EXPECT_EQ(cars.lpips_after, 800001U);
    const config::TrainConfig objaverse = made("step_lr_at: -1, start_lpips_after: 0");
    EXPECT_EQ(objaverse.schedule, config::Schedule::kConstant);
    EXPECT_EQ(objaverse.rate(1000000), 5e-5);
    EXPECT_EQ(made("step_lr_at: 7, lr_schedule: cosine").schedule, config::Schedule::kCosine);
    EXPECT_ERROR(merge(defaults(true), "opt: {step_lr_at: -2}\n"), Code::kInvalidArgument,
                 "'opt.step_lr_at' is -2, expected -1 to 10^15");
    const std::string never[] = {"opt.step_lr_at=-1"};
    const auto config = read_yaml_config(defaults(true), "merged.yaml");
    const auto warnings =
        need(config::training_warnings(config::with_values(config.value(), never).value()));
    for (const std::string& warning : warnings) EXPECT_LACKS(warning, "step_lr_at");
}

TEST(TrainConfigPublished, DataSetsOfOneFieldOfView) {
    struct Case {
        const char* over;
        double znear, zfar, fov;
        std::uint32_t resolution, attention, batch, channels;
    };
    const Case cases[] = {
        {"data: {znear: 0.8, zfar: 1.8, category: cars, white_background: true,\n"
         "  origin_distances: false, fov: 51.98948897809546}\n"
         "model: {opacity_scale: 0.001, opacity_bias: -3.0, scale_scale: 0.001}\n",
         0.8, 1.8, kCarsFov, 128, 16, 8, 3},
        {"data: {znear: 0.8, zfar: 1.8, category: cars_priors, fov: 51.98948897809546,\n"
         "  use_pred_depth: true, use_pred_normal: true, white_background: true}\n",
         0.8, 1.8, kCarsFov, 128, 16, 8, 7},
        {"data: {znear: 1.25, zfar: 2.75, category: chairs, fov: 51.98948897809546,\n"
         "  white_background: true}\n",
         1.25, 2.75, kCarsFov, 128, 16, 8, 3},
        {"data: {znear: 1.2, zfar: 4.0, category: nmr, training_resolution: 64,\n"
         "  fov: 29.999999290482176, white_background: true}\n"
         "model: {attention_resolutions: [8]}\nopt: {iterations: 1240001, batch_size: 32}\n",
         1.2, 4.0, 29.999999290482176, 64, 8, 32, 3},
        {"general: {num_devices: 2, mixed_precision: true}\n"
         "data: {znear: 0.8, zfar: 3.2, category: objaverse, fov: 49.134342641202636,\n"
         "  white_background: true}\nopt: {batch_size: 16, iterations: 350001}\n",
         0.8, 3.2, 49.134342641202636, 128, 16, 16, 3},
        {"data: {znear: 0.8, zfar: 3.2, category: gso, fov: 49.134342641202636,\n"
         "  white_background: true}\n",
         0.8, 3.2, 49.134342641202636, 128, 16, 8, 3},
    };
    for (const Case& c : cases)
        for (const bool fov : {true, false}) {
            const auto made = need(merge(defaults(fov), c.over));
            const config::ModelConfig& n = made.network;
            EXPECT_EQ(n.znear, static_cast<float>(c.znear)) << c.over;
            EXPECT_EQ(n.zfar, static_cast<float>(c.zfar)) << c.over;
            EXPECT_EQ(n.fov_degrees, static_cast<float>(c.fov)) << c.over;
            EXPECT_EQ(n.resolution, c.resolution) << c.over;
            EXPECT_EQ(n.attention_resolutions, std::vector<std::uint32_t>{c.attention}) << c.over;
            EXPECT_EQ(n.input_channels(), c.channels) << c.over;
            EXPECT_EQ(n.output_channels(), 24U) << "out_channels has no effect";
            EXPECT_EQ(n.embedding, config::Embedding::kNone);
            EXPECT_EQ(made.training.batch_size, c.batch) << c.over;
            EXPECT_FALSE(made.training.scale_terms) << c.over;
            EXPECT_TRUE(made.training.white_background) << c.over;
        }
}

/// The published code decides by the category's name, whatever the field of view of the defaults.
TEST(TrainConfigPublished, Co3dHasFocalLengthsPerView) {
    for (const std::string category : {"hydrants", "teddybears"}) {
        const std::string data = "data: {znear: -2.0, zfar: 2.0, category: " + category +
                                 ", white_background: false, origin_distances: true}\n";
        for (const bool fov : {true, false}) {
            const auto made = need(merge(defaults(fov), data));
            const config::ModelConfig& n = made.network;
            EXPECT_EQ(n.fov_degrees, 0.0F);
            EXPECT_TRUE(n.origin_distance);
            EXPECT_EQ(n.znear, -2.0F);
            EXPECT_EQ(n.input_channels(), 4U);
            EXPECT_TRUE(made.training.scale_terms);
            EXPECT_FALSE(made.training.white_background);
            // The written configuration reads as the same one.
            const auto again = need(merge(config::merged_config_text(made), "{}"));
            EXPECT_EQ(again.network.fov_degrees, 0.0F);
            EXPECT_TRUE(again.training.scale_terms);
        }
        // The file of the data set alone, and with keys that contradict it.
        const std::string alone = "data: {category: " + category + "}\n";
        const auto bare = need(merge(alone, "{}"));
        EXPECT_EQ(bare.network.fov_degrees, 0.0F);
        EXPECT_TRUE(bare.network.origin_distance);
        EXPECT_ERROR(merge(alone, "data: {fov: 30}"), Code::kInvalidArgument,
                     "'data.fov' is 30, but 'data.category' is '" + category + "'");
        EXPECT_ERROR(merge(alone, "data: {origin_distances: false}"), Code::kInvalidArgument,
                     "'data.origin_distances' is false");
        const auto off = need(merge(alone, "opt: {scale_terms: false}"));
        EXPECT_FALSE(off.training.scale_terms) << "asked for by name";
    }
}

}  // namespace
}  // namespace splat::test
