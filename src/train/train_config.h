#pragma once

#include "core/config.h"
#include "model/song_unet.h"
#include "ops/ema.h"

namespace splat::train {

/// How the learning rate goes on after its warm-up.
enum class Schedule : int {
    kConstant,
    kCosine,  ///< half a cosine down to zero at the last step
    kStep,    ///< a tenth from `step_lr_at` on
};

enum class PixelLoss : int { kL2, kL1 };

/// What a training does; the defaults are those of the published cars model. Lengths are scene units,
/// steps are updates of the parameters.
struct TrainConfig {
    std::uint64_t iterations = 800'000;
    std::uint32_t batch_size = 8;   ///< objects per step
    std::uint32_t micro_batch = 1;  ///< objects per pass; divides the batch size. More than
                                    ///< one binding takes costs forward passes, see object_slices.h
    bool recompute = false;         ///< less memory, more time: nn::ExecutorDesc
    std::uint32_t targets = 4;      ///< images rendered per object
    std::uint64_t seed = 0;

    double learning_rate = 5e-5;
    double beta1 = 0.9, beta2 = 0.999;
    double eps = 1e-15;
    Schedule schedule = Schedule::kConstant;
    std::uint64_t warmup = 0;      ///< steps in which the rate rises from zero
    std::uint64_t step_lr_at = 0;  ///< of Schedule::kStep

    PixelLoss pixel_loss = PixelLoss::kL2;
    double ssim_weight = 0;
    double lpips_weight = 0;
    std::uint64_t lpips_after = 0;           ///< steps before LPIPS takes part
    std::vector<std::string> lpips_weights;  ///< files of VGG16 and of LPIPS, see model::LpipsNet
    bool scale_terms = false;                ///< CO3D: hold scales between 1e-5 and 20
    bool white_background = true;

    bool ema = true;
    ops::EmaSchedule ema_schedule;

    model::Precision precision = model::Precision::kBalanced;

    std::uint64_t checkpoint_every = 1000;
    std::uint64_t validate_every = 10'000;
    std::uint64_t log_every = 10;
    std::uint64_t render_every = 10'000;
    std::uint32_t validation_objects = 0;  ///< 0: all
    std::uint32_t validation_views = 0;    ///< per object, spread over its views; 0: all

    /// Where the data is, for the tools that read it; the trainer takes images.
    std::string root, format, category;
    std::uint32_t subset = 0;  ///< the first objects; 0: all
    std::uint64_t cache_mib = 1024;

    /// The learning rate of a step, counted from 1.
    [[nodiscard]] double rate(std::uint64_t step) const;
};

/// Errors: kInvalidArgument, with the nearest name, for a section that nobody knows, or a key of the
/// sections opt, logging and general. Keys of data, cam_embd and model: model::predictor_config().
Status check_names(const Config& config);

/// The training that a configuration describes, with the keys of the published ones where they have
/// them:
///
///   opt      iterations batch_size micro_batch recompute imgs_per_obj base_lr betas eps lr_schedule (constant,
///            cosine, step) warmup step_lr_at loss (l2, l1) lambda_ssim lambda_lpips start_lpips_after
///            lpips_weights scale_terms ema.{use,beta,update_every,update_after_step}
///   logging  ckpt_iterations val_log loss_log render_log val_objects val_views
///   general  random_seed precision (balanced, strict, fast)
///   data     root format category subset white_background cache_mib
///
/// Without a value of its own, opt.scale_terms is true for CO3D's categories (model::is_co3d_category).
///
/// Keys of published files that say nothing here (of a GPU, of a logging service) are passed over;
/// keys of these sections that nobody knows are refused with the nearest one, those of the network
/// too (model::predictor_config).
///
/// Errors  kInvalidArgument, naming file and key; as check_names()
Result<TrainConfig> train_config(const Config& config);

/// Network and training as one JSON text, every value included, that train_config() and
/// model::predictor_config() read back.
std::string merged_config_text(const model::PredictorConfig& network, const TrainConfig& training);

/// Replace values of a configuration: each text is "key=value", the value as YAML has it ("1e-4",
/// "[1, 2]", "true"). Errors: kInvalidArgument, with the text.
Result<Config> with_values(const Config& config, std::span<const std::string> texts);

}  // namespace splat::train
