#include "train/train_config.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/config_reader.h"
#include "core/json.h"
#include "model/config_file.h"

namespace splat::train {
namespace {

/// Keys of the sections opt, logging and general: those that are read here, those of adapters, and those
/// of published files that mean nothing here.
const std::vector<std::string> kKnown = {
    "opt.iterations", "opt.batch_size", "opt.micro_batch", "opt.recompute", "opt.imgs_per_obj",
    "opt.base_lr", "opt.betas", "opt.eps", "opt.lr_schedule", "opt.warmup", "opt.step_lr_at",
    "opt.loss", "opt.lambda_ssim", "opt.lambda_lpips", "opt.start_lpips_after", "opt.lpips_weights",
    "opt.scale_terms", "opt.ema.use", "opt.ema.beta", "opt.ema.update_every",
    "opt.ema.update_after_step",
    // model::predictor_config reads these
    "opt.lora_finetune", "opt.lora_rank", "opt.lora_alpha", "opt.lora_dropout", "opt.lora_targets",
    "opt.freeze", "opt.train_with_adapters",
    // of published files
    "opt.pretrained_ckpt", "opt.pretrained_hf", "opt.epochs", "opt.ambient_light",
    "opt.num_workers", "logging.ckpt_iterations", "logging.val_log", "logging.loss_log",
    "logging.render_log", "logging.val_objects", "logging.val_views", "logging.loop_log",
    "general.random_seed", "general.precision", "general.device", "general.num_workers",
    "general.mixed_precision", "general.multiple_gpu", "general.num_devices"};

/// Sections of the network and of training, and those that published files have for other programs.
const std::vector<std::string> kSections = {"data",    "cam_embd", "model", "opt",     "logging",
                                            "general", "hydra",    "wandb", "defaults"};

void read_optimiser(ConfigReader& read, TrainConfig& c) {
    read.count("opt.iterations", c.iterations);
    read.count("opt.batch_size", c.batch_size);
    read.count("opt.micro_batch", c.micro_batch);
    read.flag("opt.recompute", c.recompute);
    read.count("opt.imgs_per_obj", c.targets);
    read.number("opt.base_lr", c.learning_rate, 0, 1e3);
    std::vector<double> betas = {c.beta1, c.beta2};
    read.numbers("opt.betas", betas);
    if (betas.size() == 2) {
        c.beta1 = betas[0];
        c.beta2 = betas[1];
    }
    read.number("opt.eps", c.eps);
    const std::string schedule =
        read.choice("opt.lr_schedule", "constant", {"constant", "cosine", "step"});
    c.schedule = schedule == "cosine" ? Schedule::kCosine
                 : schedule == "step" ? Schedule::kStep
                                      : Schedule::kConstant;
    read.count("opt.warmup", c.warmup);
    read.count("opt.step_lr_at", c.step_lr_at);
    read.flag("opt.ema.use", c.ema);
    read.number("opt.ema.beta", c.ema_schedule.most, 0, 1);
    read.count("opt.ema.update_every", c.ema_schedule.update_every);
    read.count("opt.ema.update_after_step", c.ema_schedule.update_after);
}

void read_losses(ConfigReader& read, TrainConfig& c) {
    c.pixel_loss =
        read.choice("opt.loss", "l2", {"l2", "l1"}) == "l1" ? PixelLoss::kL1 : PixelLoss::kL2;
    read.number("opt.lambda_ssim", c.ssim_weight, 0, 1);
    read.number("opt.lambda_lpips", c.lpips_weight, 0, 1);
    read.count("opt.start_lpips_after", c.lpips_after);
    read.texts("opt.lpips_weights", c.lpips_weights);
    read.flag("opt.scale_terms", c.scale_terms);
    read.flag("data.white_background", c.white_background);
}

void read_logging(ConfigReader& read, TrainConfig& c) {
    read.count("logging.ckpt_iterations", c.checkpoint_every);
    read.count("logging.val_log", c.validate_every);
    read.count("logging.loss_log", c.log_every);
    read.count("logging.render_log", c.render_every);
    read.count("logging.val_objects", c.validation_objects);
    read.count("logging.val_views", c.validation_views);
    read.count("general.random_seed", c.seed);
    const std::string precision =
        read.choice("general.precision", "balanced", {"balanced", "strict", "fast"});
    c.precision = precision == "strict" ? model::Precision::kStrict
                  : precision == "fast" ? model::Precision::kFast
                                        : model::Precision::kBalanced;
}

void read_data(ConfigReader& read, TrainConfig& c) {
    read.text("data.root", c.root);
    read.text("data.format", c.format);
    read.text("data.category", c.category);
    // Published files say -1 for all.
    std::int64_t subset = -1;
    read.whole("data.subset", subset);
    c.subset = subset < 0 ? 0 : static_cast<std::uint32_t>(std::min<std::int64_t>(subset, 1 << 30));
    read.count("data.cache_mib", c.cache_mib);
}

Status check(const TrainConfig& c, const char* what) {
    const auto wrong = [&](const char* key, std::uint64_t value, const char* expected) {
        return error(Code::kInvalidArgument, "%s: '%s' is %llu, expected %s", what, key,
                     static_cast<unsigned long long>(value), expected);
    };
    if (c.batch_size < 1 || c.batch_size > 4096)
        return wrong("opt.batch_size", c.batch_size, "1 to 4096");
    if (c.targets < 1 || c.targets > 256) return wrong("opt.imgs_per_obj", c.targets, "1 to 256");
    if (c.micro_batch < 1 || c.batch_size % c.micro_batch != 0)
        return wrong("opt.micro_batch", c.micro_batch,
                     format("a divisor of opt.batch_size, %u", c.batch_size).c_str());
    if (c.ema && c.ema_schedule.update_every == 0)
        return wrong("opt.ema.update_every", 0, "at least 1");
    if (!(c.beta1 >= 0 && c.beta1 < 1 && c.beta2 >= 0 && c.beta2 < 1))
        return error(Code::kInvalidArgument,
                     "%s: 'opt.betas' are %g and %g, expected two numbers from 0 to below 1", what,
                     c.beta1, c.beta2);
    if (c.ssim_weight + c.lpips_weight > 1)
        return error(
            Code::kInvalidArgument,
            "%s: 'opt.lambda_ssim' and 'opt.lambda_lpips' are %g and %g, expected a sum of "
            "at most 1",
            what, c.ssim_weight, c.lpips_weight);
    return {};
}

ConfigEntry entry(const char* key, ConfigScalar value) {
    return {key, {std::move(value)}, false, false};
}

ConfigScalar whole(std::uint64_t value) {
    return static_cast<std::int64_t>(value);
}

}  // namespace

double TrainConfig::rate(std::uint64_t step) const {
    const auto at = static_cast<double>(step);
    if (step <= warmup) return learning_rate * at / static_cast<double>(warmup + 1);
    if (schedule == Schedule::kStep && step_lr_at > 0 && step >= step_lr_at)
        return learning_rate / 10;
    if (schedule != Schedule::kCosine || iterations <= warmup) return learning_rate;
    const double done = std::min(
        1.0, (at - static_cast<double>(warmup) - 1) / static_cast<double>(iterations - warmup));
    return learning_rate * (1 + std::cos(std::numbers::pi * done)) / 2;
}

Status check_names(const Config& config) {
    SPLAT_TRY(config.refuse_unknown_sections(kSections));
    return config.refuse_unknown(kKnown, {"opt", "logging", "general"});
}

Result<TrainConfig> train_config(const Config& config) {
    SPLAT_TRY(check_names(config));
    TrainConfig c;
    ConfigReader read(config);
    read_optimiser(read, c);
    read_losses(read, c);
    read_logging(read, c);
    read_data(read, c);
    SPLAT_TRY(read.status());
    if (model::is_co3d_category(c.category)) {
        SPLAT_ASSIGN(c.scale_terms, config.get<bool>("opt.scale_terms", true));
    }
    SPLAT_TRY(check(c, config.what().c_str()));
    return c;
}

std::string merged_config_text(const model::PredictorConfig& network, const TrainConfig& c) {
    constexpr const char* kSchedules[] = {"constant", "cosine", "step"};
    constexpr const char* kPrecisions[] = {"strict", "balanced", "fast"};
    const auto both = read_json_config(model::config_text(network), "network");
    SPLAT_ASSERT(both.ok());
    Config merged = both.value();
    std::vector<ConfigEntry> entries = {
        entry("data.root", c.root),
        entry("data.format", c.format),
        entry("data.category", c.category),
        entry("data.subset", c.subset == 0 ? ConfigScalar(std::int64_t{-1}) : whole(c.subset)),
        entry("data.white_background", c.white_background),
        entry("data.cache_mib", whole(c.cache_mib)),
        entry("opt.iterations", whole(c.iterations)),
        entry("opt.batch_size", whole(c.batch_size)),
        entry("opt.micro_batch", whole(c.micro_batch)),
        entry("opt.recompute", c.recompute),
        entry("opt.imgs_per_obj", whole(c.targets)),
        entry("opt.base_lr", c.learning_rate),
        {"opt.betas", {c.beta1, c.beta2}, true, false},
        entry("opt.eps", c.eps),
        entry("opt.lr_schedule", std::string(kSchedules[static_cast<int>(c.schedule)])),
        entry("opt.warmup", whole(c.warmup)),
        entry("opt.step_lr_at", whole(c.step_lr_at)),
        entry("opt.loss", std::string(c.pixel_loss == PixelLoss::kL1 ? "l1" : "l2")),
        entry("opt.lambda_ssim", c.ssim_weight),
        entry("opt.lambda_lpips", c.lpips_weight),
        entry("opt.start_lpips_after", whole(c.lpips_after)),
        {"opt.lpips_weights", {c.lpips_weights.begin(), c.lpips_weights.end()}, true, false},
        entry("opt.scale_terms", c.scale_terms),
        entry("opt.ema.use", c.ema),
        entry("opt.ema.beta", c.ema_schedule.most),
        entry("opt.ema.update_every", whole(c.ema_schedule.update_every)),
        entry("opt.ema.update_after_step", whole(c.ema_schedule.update_after)),
        entry("logging.ckpt_iterations", whole(c.checkpoint_every)),
        entry("logging.val_log", whole(c.validate_every)),
        entry("logging.loss_log", whole(c.log_every)),
        entry("logging.render_log", whole(c.render_every)),
        entry("logging.val_objects", whole(c.validation_objects)),
        entry("logging.val_views", whole(c.validation_views)),
        entry("general.random_seed", whole(c.seed)),
        entry("general.precision", std::string(kPrecisions[static_cast<int>(c.precision)])),
    };
    for (ConfigEntry& each : entries) merged.set(std::move(each));
    return config_json(merged);
}

Result<Config> with_values(const Config& config, std::span<const std::string> texts) {
    Config changed = config;
    for (const std::string& text : texts) {
        const std::size_t sign = text.find('=');
        if (sign == std::string::npos || sign == 0)
            return error(Code::kInvalidArgument, "'%s' is no key=value", text.c_str());
        // A document of one line; the key's dots are part of its name, as in Config.
        SPLAT_ASSIGN(const Config line,
                     read_yaml_config(text.substr(0, sign) + ": " + text.substr(sign + 1),
                                      "'" + text + "'"));
        for (const ConfigEntry& each : line.entries()) changed.set(each);
    }
    return changed;
}

}  // namespace splat::train
