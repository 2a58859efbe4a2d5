#pragma once

#include <array>

#include "config/model_config.h"
#include "core/json.h"

namespace splat::config {

/// The learning rate after its warm-up.
enum class Schedule : int {
    kConstant,
    kCosine,  ///< half a cosine, which reaches zero one step after the last
    kStep,    ///< a tenth from `step_lr_at` on
};

enum class PixelLoss : int { kL2, kL1 };

enum class EdgeFilter : int { kSobel, kScharr };

/// Settings of a training; the defaults are those of the published cars model. Lengths are scene units,
/// steps are updates of the parameters. config_keys.cpp says which key is which field.
struct TrainConfig {
    std::uint64_t iterations = 800'000;
    std::uint32_t batch_size = 8;   ///< objects per step
    std::uint32_t micro_batch = 1;  ///< objects per pass; divides the batch size. More than fit
        ///< one binding run in slices, with extra forward passes: model/object_slices.h
    std::uint32_t read_every = 1;  ///< steps whose losses are read together
    bool recompute = false;        ///< less memory, more time: nn::ExecutorDesc
    std::uint32_t targets = 4;     ///< images rendered per object
    std::uint64_t seed = 0;

    double learning_rate = 5e-5;
    std::array<double, 2> betas = {0.9, 0.999};
    double eps = 1e-15;
    Schedule schedule = Schedule::kConstant;
    std::uint64_t warmup = 0;      ///< steps in which the rate rises from zero
    std::uint64_t step_lr_at = 0;  ///< step at which Schedule::kStep lowers the rate

    PixelLoss pixel_loss = PixelLoss::kL2;
    /// Weights of kLossTerms.
    double ssim_weight = 0;
    double edge_weight = 0;
    double lpips_weight = 0;
    double plane_weight = 0;
    EdgeFilter edge_filter = EdgeFilter::kSobel;
    bool edge_by_size = false;  ///< weigh edges by the size of the Gaussians there: train::SizeMap
    std::uint64_t lpips_after = 0;           ///< steps before LPIPS takes part
    std::vector<std::string> lpips_weights;  ///< files of VGG16 and of LPIPS, see model::LpipsNet
    bool scale_terms = false;                ///< CO3D: hold scales between 1e-5 and 20
    bool white_background = true;
    std::uint32_t target_resolution =
        0;  ///< pixels of the side of images that are compared; 0: the network's

    /// Each so many steps the inputs are views drawn of what the network predicts, see train/cycle.cpp. 0: none.
    std::uint64_t cycle_every = 0;
    std::uint64_t cycle_after = 0;  ///< steps before the first
    double cycle_weight = 1;        ///< factor of the loss in such steps

    bool ema = true;
    double ema_most = 0.9999;  ///< see ops::EmaSchedule
    std::uint64_t ema_every = 10;
    std::uint64_t ema_after = 100;

    Precision precision = Precision::kBalanced;

    std::uint64_t checkpoint_every = 1000;
    std::uint64_t validate_every = 10'000;
    std::uint64_t log_every = 10;
    std::uint32_t validation_objects = 0;  ///< 0: all
    std::uint32_t validation_views = 0;    ///< per object, spread over its views; 0: all

    /// One after another, each with its own opt.stages' values and `iterations`; none: the whole training is one.
    std::vector<TrainConfig> stages;

    std::string pretrained;  ///< weights to start from, a file or a folder; empty: none

    /// Where the data is, for the tools that read it; the trainer takes images.
    std::string root, format, category;
    std::string objects_file, excluded_file, views_file;  ///< see data::DatasetDesc
    std::string embedding_file, tokens_file;              ///< see data::ViewVectors
    std::uint32_t subset = 0;                             ///< the first objects; 0: all
    bool allow_missing = false;                           ///< leave incomplete objects out
    std::uint64_t cache_mib = 1024;
    std::uint32_t loader_threads = 0;  ///< 0: by the device, see train::loader_threads

    /// The learning rate of a step, counted from 1.
    [[nodiscard]] double rate(std::uint64_t step) const;

    /// The stage of the update that follows so many.
    [[nodiscard]] std::size_t stage_after(std::uint64_t updates) const;
    /// Updates of this stage and those before it.
    [[nodiscard]] std::uint64_t end_of(std::size_t stage) const;
    /// Objects of the largest batch of all stages.
    [[nodiscard]] std::uint32_t most_batch() const;
    /// The settings while a stage lasts: the run's, with the stage's values.
    [[nodiscard]] TrainConfig in_stage(std::size_t stage) const;
    /// Whether some stage gives this term of the loss a weight.
    [[nodiscard]] bool weighs(double TrainConfig::*weight) const;
};

inline std::vector<JsonScalar> edge_attributes(const TrainConfig& config) {
    return {{"scharr", config.edge_filter == EdgeFilter::kScharr}};
}

/// A term of the loss besides that of pixels: a line in kLossTerms and a weight in TrainConfig make one, and the
/// operator computes it. What is weighed, measured and told goes through this table, and so does the weight's key.
struct LossTerm {
    const char* name;  ///< in metrics
    /// Operator of two images and maybe weights of pixels; nullptr: train::ScenePlanes or model::LpipsNet.
    const char* op;
    double TrainConfig::*weight;
    const char* key;    ///< key of the weight
    const char* about;  ///< one sentence on the weight
    double most = 1e6;  ///< largest weight
    bool published = false;
    bool similarity = false;  ///< grows when images agree: the loss is 1 - value
    /// Takes its weight from the pixel loss; all of these add up to 1 at most.
    bool replaces = false;
    std::vector<JsonScalar> (*attributes)(const TrainConfig&) = nullptr;

    [[nodiscard]] constexpr bool is_lpips() const { return weight == &TrainConfig::lpips_weight; }
};

/// In the order in which their gradients are added.
inline constexpr LossTerm kLossTerms[] = {
    {.name = "ssim",
     .op = "ssim",
     .weight = &TrainConfig::ssim_weight,
     .key = "opt.lambda_ssim",
     .about = "Weight of 1 - SSIM; at most 1 together with opt.lambda_lpips.",
     .most = 1,
     .similarity = true,
     .replaces = true},
    {.name = "edge",
     .op = "edge_loss",
     .weight = &TrainConfig::edge_weight,
     .key = "opt.lambda_edge",
     .about = "Weight of the difference of edges, added to the other terms: mean |Dx (a - b)| + "
              "|Dy (a - b)|.",
     .attributes = edge_attributes},
    {.name = "plane",
     .op = nullptr,
     .weight = &TrainConfig::plane_weight,
     .key = "opt.lambda_plane",
     .about = "Weight of the mean squared distance of Gaussians from their plane, and of their own "
              "thickness across it, in squares of the scene's unit, added to the other terms; "
              "trainings need maps of planes."},
    {.name = "lpips",
     .op = nullptr,
     .weight = &TrainConfig::lpips_weight,
     .key = "opt.lambda_lpips",
     .about = "Weight of LPIPS.",
     .most = 1,
     .published = true,
     .replaces = true}};

}  // namespace splat::config
