#include "config/train_config.h"

#include <gtest/gtest.h>

#include "config/config_file.h"
#include "config/effects.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using config::TrainConfig;

Result<TrainConfig> read_training(const std::string& yaml) {
    SPLAT_ASSIGN(const Config config, read_yaml_config(yaml, "test.yaml"));
    return config::train_config(config);
}

TEST(TrainConfigRules, DefaultsAreThePublishedOnes) {
    const auto c = need(read_training("{}"));
    EXPECT_EQ(c.batch_size, 8U);
    EXPECT_EQ(c.targets, 4U);
    EXPECT_EQ(c.learning_rate, 5e-5);
    EXPECT_EQ(c.eps, 1e-15);
    EXPECT_EQ(c.ema_after, 100U);
    EXPECT_EQ(c.rate(1), 5e-5);
    EXPECT_EQ(c.rate(700'000), 5e-5);
}

TEST(TrainConfigRules, ReadsWhatItWrites) {
    const auto config = need(read_yaml_config(
        "data: {training_resolution: 64, root: somewhere, subset: 3, white_background: false}\n"
        "model: {base_dim: 32}\n"
        "opt: {iterations: 1234, batch_size: 6, micro_batch: 3, recompute: true, imgs_per_obj: 5,\n"
        "  read_every: 4, num_workers: 2,\n"
        "  base_lr: 1e-4,\n"
        "  betas: [0.8, 0.99], lr_schedule: cosine, warmup: 10, loss: l1, lambda_ssim: 0.2,\n"
        "  ema: {use: true, beta: 0.99, update_every: 2, update_after_step: 7},\n"
        "  lora_finetune: true, lora_rank: 8}\n"
        "logging: {ckpt_iterations: 5, val_objects: 2}\n"
        "general: {random_seed: 9, precision: fast}\n",
        "test.yaml"));
    const auto network = need(config::model_config(config));
    const auto training = need(config::train_config(config));
    const std::string text = config::merged_config_text({network, training});
    const auto again = need(read_json_config(text, "merged"));
    const auto network2 = need(config::model_config(again));
    const auto training2 = need(config::train_config(again));
    EXPECT_EQ(config::merged_config_text({network2, training2}), text);
    EXPECT_EQ(network2.lora.rank, 8U);
    const TrainConfig& c = training2;
    EXPECT_EQ(c.iterations, 1234U);
    EXPECT_EQ(c.micro_batch, 3U);
    EXPECT_EQ(c.read_every, 4U);
    EXPECT_EQ(c.loader_threads, 2U);
    EXPECT_TRUE(c.recompute);
    EXPECT_EQ(c.betas[0], 0.8);
    EXPECT_EQ(c.schedule, config::Schedule::kCosine);
    EXPECT_EQ(c.pixel_loss, config::PixelLoss::kL1);
    EXPECT_EQ(c.ema_every, 2U);
    EXPECT_EQ(c.precision, config::Precision::kFast);
    EXPECT_EQ(c.subset, 3U);
    EXPECT_EQ(c.root, "somewhere");
    EXPECT_FALSE(c.white_background);
}

TEST(TrainConfigRules, TheRateFollowsItsSchedule) {
    TrainConfig c;
    c.learning_rate = 1;
    c.iterations = 110;
    c.warmup = 9;
    EXPECT_DOUBLE_EQ(c.rate(1), 0.1);
    EXPECT_DOUBLE_EQ(c.rate(9), 0.9);
    EXPECT_DOUBLE_EQ(c.rate(10), 1);
    c.schedule = config::Schedule::kCosine;
    EXPECT_DOUBLE_EQ(c.rate(10), 1);
    EXPECT_LT(c.rate(110), 1e-3);
    EXPECT_GT(c.rate(110), 0);
    EXPECT_NEAR(c.rate(111), 0, 1e-15) << "one step after the last";
    EXPECT_GT(c.rate(60), c.rate(61));
    c.schedule = config::Schedule::kStep;
    c.step_lr_at = 50;
    EXPECT_DOUBLE_EQ(c.rate(49), 1);
    EXPECT_DOUBLE_EQ(c.rate(50), 0.1);
}

TEST(TrainConfigRules, ReplacesValues) {
    const auto config = need(read_yaml_config("opt: {base_lr: 1, batch_size: 2}", "test.yaml"));
    const std::string texts[] = {"opt.base_lr=1e-3", "general.random_seed=5",
                                 "opt.betas=[0.5, 0.75]"};
    const auto c = need(config::train_config(need(config::with_values(config, texts))));
    EXPECT_EQ(c.learning_rate, 1e-3);
    EXPECT_EQ(c.seed, 5U);
    EXPECT_EQ(c.betas[1], 0.75);
    EXPECT_EQ(c.batch_size, 2U);
    const std::string wrong[] = {"opt.base_lr"};
    EXPECT_ERROR(config::with_values(config, wrong), Code::kInvalidArgument,
                 "'opt.base_lr' is not of the form key=value");
}

constexpr const char* kTwoStages =
    "opt: {batch_size: 4, base_lr: 1e-3, loss: l1, stages: [{iterations: 3, target_resolution: "
    "16},\n"
    "  {iterations: 2, batch_size: 2, base_lr: 1e-4, loss: l2, lambda_ssim: 0.2}]}";

TEST(TrainConfigStages, AreMapsOfOtherKeys) {
    const auto config = need(read_yaml_config(kTwoStages, "test.yaml"));
    const auto settings = need(config::settings_of(config));
    const TrainConfig& c = settings.training;
    ASSERT_EQ(c.stages.size(), 2U);
    EXPECT_EQ(c.iterations, 5U);
    EXPECT_EQ(c.most_batch(), 4U);
    const std::size_t stages[] = {0, 0, 0, 1, 1, 1};
    for (std::uint64_t updates = 0; updates < std::size(stages); ++updates)
        EXPECT_EQ(c.stage_after(updates), stages[updates]) << updates;
    EXPECT_EQ(c.end_of(0), 3U);
    EXPECT_EQ(c.end_of(1), 5U);
    const TrainConfig first = c.in_stage(0), second = c.in_stage(1);
    EXPECT_EQ(first.iterations, 5U) << "those of the run, which schedules depend on";
    EXPECT_EQ(first.batch_size, 4U) << "that of opt";
    EXPECT_EQ(first.target_resolution, 16U);
    EXPECT_EQ(first.rate(1), 1e-3);
    EXPECT_EQ(second.rate(4), 1e-4);
    EXPECT_EQ(second.batch_size, 2U);
    EXPECT_EQ(second.pixel_loss, config::PixelLoss::kL2);
    EXPECT_EQ(second.target_resolution, 0U);
    EXPECT_TRUE(c.weighs(&TrainConfig::ssim_weight));
    EXPECT_FALSE(c.weighs(&TrainConfig::edge_weight));

    const std::string text = config::merged_config_text(settings);
    const auto again = need(config::settings_of(need(read_json_config(text, "merged"))));
    EXPECT_EQ(config::merged_config_text(again), text);
    EXPECT_EQ(again.training.stages.size(), 2U);
    EXPECT_EQ(config::merged_config_text({}).find("stages"), std::string::npos);
    EXPECT_EQ(config::value_text(need(read_json_config(text, "merged")), "opt.stages"),
              "[{iterations: 3, target_resolution: 16}, {iterations: 2, batch_size: 2, "
              "base_lr: 0.0001, loss: \"l2\", lambda_ssim: 0.2}]")
        << "what differs from opt";
}

TEST(TrainConfigStages, AreReplacedAsAWhole) {
    const auto merged = need(read_json_config(
        config::merged_config_text(
            need(config::settings_of(need(read_yaml_config(kTwoStages, "test.yaml"))))),
        "merged"));
    const auto changed = [&](std::vector<std::string> texts) {
        return need(config::train_config(need(config::with_values(merged, texts))));
    };
    const TrainConfig one = changed({"opt.stages=[{iterations: 7}]"});
    EXPECT_EQ(one.stages.size(), 1U);
    EXPECT_EQ(one.iterations, 7U);
    EXPECT_EQ(one.in_stage(0).ssim_weight, 0);
    const TrainConfig longer = changed({"opt.stages.1.iterations=9"});
    EXPECT_EQ(longer.iterations, 12U);
    EXPECT_EQ(longer.in_stage(1).ssim_weight, 0.2);
    const TrainConfig none = changed({"opt.stages=[]", "opt.iterations=4"});
    EXPECT_TRUE(none.stages.empty());
    EXPECT_EQ(none.iterations, 4U);
    EXPECT_EQ(changed({"opt.stages=[]"}).iterations, 5U) << "of the stages that were";
}

TEST(TrainConfigStages, RefuseWhatContradicts) {
    const std::pair<const char*, const char*> cases[] = {
        {"stages: 3", "'opt.stages' is 3, expected a list of maps"},
        {"stages: [{base_lr: 1e-4}]", "stage 0 of 'opt.stages' has no 'iterations'"},
        {"stages: [{iterations: 0}]", "stage 0 of 'opt.stages' has 0 iterations"},
        {"stages: [{iterations: 2, rate: 1}]", "there is no key 'opt.stages.0.rate'"},
        {"stages: [{iterations: 2, betas: [0, 0]}]", "there is no key 'opt.stages.0.betas'"},
        {"iterations: 9, stages: [{iterations: 2}, {iterations: 3}]",
         "'opt.iterations' is 9, but the stages of 'opt.stages' have 5 updates in all"},
        {"start_lpips_after: 2, lambda_lpips: 0.1, stages: [{iterations: 2}]",
         "both 'opt.stages' and 'opt.start_lpips_after' are given"},
        {"lr_schedule: step, step_lr_at: 3, stages: [{iterations: 2, base_lr: 1}]",
         "stage 0 of 'opt.stages' has the rate 1, but 'opt.lr_schedule' is step"},
        {"stages: [{iterations: 2}, {iterations: 2, loss: l3}]",
         "stage 1 of 'opt.stages': 'opt.loss' is 'l3'"},
        {"stages: [{iterations: 2}, {iterations: 2, lambda_ssim: 0.7, lambda_lpips: 0.7}]",
         "stage 1 of 'opt.stages': 'opt.lambda_ssim' and 'opt.lambda_lpips' are 0.7 and 0.7"},
        {"micro_batch: 4, stages: [{iterations: 2}, {iterations: 2, batch_size: 6}]",
         "stage 1 of 'opt.stages': 'opt.micro_batch' is 4, expected a divisor"},
        {"stages: [{iterations: 2, target_resolution: 48}]",
         "stage 0 of 'opt.stages': 'opt.target_resolution' is 48, expected a divisor of "
         "data.training_resolution, 128"}};
    for (const auto& [keys, says] : cases) {
        const auto config = need(read_yaml_config(std::string("opt: {") + keys + "}", "test.yaml"));
        EXPECT_ERROR(config::settings_of(config), Code::kInvalidArgument, says);
    }
    std::string many = "opt: {stages: [{iterations: 1}";
    for (int i = 0; i < 100; ++i) many += ", {iterations: 1}";
    EXPECT_ERROR(config::settings_of(need(read_yaml_config(many + "]}", "test.yaml"))),
                 Code::kInvalidArgument, "'opt.stages' has more than 100 stages");
}

/// Published configurations have a weight of LPIPS but name no files; evaluations read them too.
TEST(TrainConfigRules, TakesTheWeightOfLpipsWithoutItsFiles) {
    const auto config = need(read_training("opt: {lambda_lpips: 0.01, start_lpips_after: 5}"));
    EXPECT_EQ(config.lpips_weight, 0.01);
    EXPECT_EQ(config.lpips_after, 5U);
}

/// Files that Hydra merged contain sections of other programs.
TEST(TrainConfigRules, LeavesSectionsOfOtherProgramsAlone) {
    EXPECT_OK(
        read_training("defaults: [{dataset: cars}, _self_]\nhydra: {run: {dir: x}}\n"
                      "wandb: {project: gs_pred}\ngeneral: {device: 0}\nlogging:\nopt: "
                      "{pretrained_hf: null}\n"));
}

TEST(TrainConfigRules, RefusesAndNamesTheKey) {
    const std::pair<const char*, const char*> cases[] = {
        {"opt: {base_lrr: 1}", "there is no key 'opt.base_lrr'; did you mean 'opt.base_lr'?"},
        {"opt: {batch_size: 0}", "'opt.batch_size' is 0, expected 1 to 4096"},
        {"opt: {micro_batch: 3}",
         "'opt.micro_batch' is 3, expected a divisor of opt.batch_size, 8"},
        {"opt: {base_lr: -1}", "'opt.base_lr' is -1, expected 0 to 1000"},
        {"opt: {betas: [1, 2]}", "'opt.betas' is 1, expected 0 to below 1"},
        {"opt: {loss: huber}", "'opt.loss' is 'huber', expected one of l2, l1"},
        {"opt: {lambda_ssim: 0.7, lambda_lpips: 0.6}", "expected a sum of at most 1"},
        {"opt: {ema: {update_every: 0}}", "'opt.ema.update_every' is 0, expected at least 1"},
        {"logging: {valog: 1}", "did you mean 'logging.val_log'?"},
        {"modle: {base_dim: 64}", "there is no section 'modle'; did you mean 'model'?"},
        {"base_lr: 1", "there is no section 'base_lr'"},
        {"opt: {lora_rnak: 4}", "there is no key 'opt.lora_rnak'; did you mean 'opt.lora_rank'?"},
    };
    for (const auto& [yaml, part] : cases)
        EXPECT_ERROR(read_training(yaml), Code::kInvalidArgument, part);
    EXPECT_ERROR(read_training("opt: {loss: " + std::string(100'000, 'x') + "}"),
                 Code::kInvalidArgument, "xxx...', expected one of l2, l1");
}

}  // namespace
}  // namespace splat::test
