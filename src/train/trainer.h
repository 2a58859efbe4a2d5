#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "gaussians/gaussian_set.h"
#include "io/weights_file.h"
#include "model/model.h"
#include "model/weights.h"
#include "raster/rasterizer.h"
#include "run/group.h"
#include "train/gradient_sum.h"
#include "train/optimiser.h"
#include "train/render_loss.h"
#include "train/scale_terms.h"
#include "train/scene_planes.h"
#include "train/size_map.h"
#include "train/train_step.h"

namespace splat::train {

/// Commands that copy a set, or its gradients, to another of the same size.
Result<vk::CommandList> copy_of_set(vk::Context& context, const gaussians::SetViews& from,
                                    const gaussians::SetViews& to);

/// Splatter Image's training: predict, render, compare, and back.
///
/// The device decides whether a step updates the weights, and keeps losses and decisions of steps until they are read:
/// by read(), by step() with a result, and by what must know the updates done. Of each step the host reads at once only
/// what the rasterizer's arrays depend on, and scales for CO3D's terms.
///
/// Accumulates the gradients of a batch in passes of micro_batch objects, weighted for the mean over the
/// batch. The size of a pass changes only rounding and which activations dropout drops. CO3D's terms of
/// scales are means over the outliers of the batch: passes that have some run twice, except the last of an odd number.
///
/// Ranks of a group make the same calls, each with its own objects of the batch. In a step the host then reads losses
/// and counts, which all ranks get before they decide whether it updates. All but times is the same on all ranks.
///
/// Errors       kShape and kInvalidArgument for a batch that does not fit, before anything ran; those of
///              Context::run, after which the step counts as not done; with a group those of any rank, on all
/// Determinism  the same bits for the same batches, seed and device, and for any number of ranks whose group does not
///              sum by itself
/// Source       Szymanowicz et al. 2024, arXiv:2312.13150, section 3.3
class Trainer {
  public:
    /// `group`: null: no other ranks. Errors: also kInvalidArgument for a batch that ranks cannot share.
    static Result<std::unique_ptr<Trainer>> create(vk::Context& context,
                                                   const model::ModelConfig& network,
                                                   const config::TrainConfig& config,
                                                   run::Group* group = nullptr);

    /// Objects of a batch that this rank trains on, and the first of them.
    [[nodiscard]] std::uint32_t objects() const { return objects_; }
    [[nodiscard]] std::uint32_t first_object() const {
        return group_ == nullptr ? 0 : group_->rank() * objects_;
    }

    /// Do a step; with `read` what became of it and of all unread steps goes to results(). An update that ran counts as
    /// unread until it is read, also if this fails afterwards.
    Status step(const TrainBatch& batch, bool read = false);

    /// Do a step, read all that is unread, and give the step's result; results() keeps those of the steps before it.
    Status step(const TrainBatch& batch, TrainStep& result);

    /// Call it on a rank that cannot do the step which others begin, so that they get its error.
    Status abstain(const Status& why) { return agreed(why); }

    /// Read what became of the steps since the last read.
    Status read();

    /// Results that were read but not yet given, in the order of the steps; of more than kMostResults the latest.
    [[nodiscard]] std::deque<TrainStep>& results() { return results_; }
    static constexpr std::size_t kMostResults = 65'536;

    /// Steps since the last read. Thread-safe, like the following.
    [[nodiscard]] std::uint64_t unread() const {
        const std::uint64_t read = attempts_read_;  // before attempts_, which may grow meanwhile
        return attempts_ - read;
    }

    /// Steps without an update at the end of those that were read.
    [[nodiscard]] std::uint64_t skipped_in_a_row() const { return skipped_in_a_row_; }

    [[nodiscard]] model::Model& model() { return *model_; }
    [[nodiscard]] const config::TrainConfig& config() const { return config_; }
    /// Updates of the weights by the steps that were read. Thread-safe, like attempts().
    [[nodiscard]] std::uint64_t steps() const { return steps_; }

    /// Calls of step() that ran to their end, including skipped ones.
    [[nodiscard]] std::uint64_t attempts() const { return attempts_; }

    /// The result of the latest step that was read. Thread-safe.
    [[nodiscard]] std::optional<TrainStep> last() const {
        const std::lock_guard lock(last_mutex_);
        return last_;
    }

    /// Go on with other settings of a stage, see TrainConfig::stages: batches, losses, targets and rate may differ.
    /// Reads what is unread. After an error of building the stage, steps fail.
    Status enter(const config::TrainConfig& stage);

    /// The averaged weights as a state dict, or the current ones without averaging.
    Result<io::NamedTensors> averaged_state();

    /// Everything that the next step depends on except the batch: parameters, moments, averages and
    /// counters, with the configuration and a checksum.
    Result<io::WeightsFile> checkpoint();

    /// Continue from a checkpoint, bit-exactly. All or nothing. Errors: kFormat for a file that is
    /// none or has a wrong checksum; kInvalidArgument for another network or optimiser.
    Status resume(const io::WeightsFile& file);

  private:
    Trainer(vk::Context& context, const config::TrainConfig& config, run::Group* group)
        : context_(context),
          config_(config),
          group_(group != nullptr && group->count() > 1 ? group : nullptr),
          objects_(config.batch_size / (group_ == nullptr ? 1 : group_->count())) {}
    Status build(const model::ModelConfig& network);
    Status build_stage();
    Status build_copies(const raster::RasterDesc& object, const raster::RasterDesc& call);
    Status build_loss(const raster::RasterDesc& object);
    static Status check_stage(const config::TrainConfig& config, run::Group* group);
    /// Pixels of the side of targets.
    [[nodiscard]] std::uint32_t target_side() const {
        const std::uint32_t asked = config_.target_resolution;
        return asked == 0 ? model_->config().resolution : asked;
    }
    Status build_optimiser();
    Status check(const TrainBatch& batch) const;
    /// A step that ran, without what only the device knows.
    struct Unread {
        TrainStep step;
        double lpips_weight = 0, scale_loss = 0;
    };
    Status prepare(const TrainBatch& batch);
    Status attempt(const TrainBatch& batch, Unread& made, bool read);
    Status update(std::span<const std::byte> notes, Unread& made, bool read);
    /// All that is unread, or nothing.
    void take(std::span<const OptimiserRead> updates);
    [[nodiscard]] TrainStep result_of(const Unread& made, const OptimiserRead& update);
    [[nodiscard]] Optimiser::Use taking();
    /// Lists that a step runs, if the rasterizer's arrays hold its pairs.
    [[nodiscard]] std::size_t lists_of_a_step() const;

    /// Outliers of the passes of a batch, those of all ranks.
    using Outliers = std::vector<ScaleOutliers>;
    /// Passes of a batch, by all ranks, and the first of this rank.
    [[nodiscard]] std::uint32_t passes() const { return config_.batch_size / config_.micro_batch; }
    [[nodiscard]] std::uint32_t first_pass() const { return first_object() / config_.micro_batch; }

    /// Give the network the objects of a pass from `first` on; what runs next counts as its time.
    Status set_input(const TrainBatch& batch, std::uint32_t first, TrainStep& result);
    Status pass(const TrainBatch& batch, std::uint32_t first, Outliers& outliers, TrainStep& result,
                const nn::BetweenParts& between);
    /// Draw `drawn_` objects of the batch in one call, those from `slot` on of the pass, and compare each.
    Status render(const TrainBatch& batch, std::uint32_t first, std::uint32_t slot,
                  TrainStep& result);
    Status compare(const TrainBatch& batch, std::uint32_t first, std::uint32_t slot);
    /// The network's part of a set. Cycles add as many Gaussians behind it; other sets are all of the network.
    [[nodiscard]] gaussians::SetViews predicted(const gaussians::GaussianSet& set) const;

    // trainer_group.cpp
    /// The same status on all ranks.
    Status agreed(const Status& mine) { return group_ == nullptr ? mine : group_->agree(mine); }
    [[nodiscard]] std::uint64_t bytes_sent() const {
        return group_ == nullptr ? 0 : group_->bytes_sent();
    }
    Status share(Outliers& outliers);
    /// The notes of all ranks, and in `step` what they drew; empty without a group.
    Result<std::vector<std::byte>> share_notes(TrainStep& step);
    Status read_notes(std::span<std::byte> losses, std::span<std::byte> counts);
    [[nodiscard]] std::uint64_t losses_bytes() const { return loss_->losses().bytes; }
    [[nodiscard]] std::uint64_t counts_bytes() const {
        return model_->output_ledger().counts().bytes;
    }

    // scale_terms.cpp
    Result<std::vector<float>> read_scales(const gaussians::SetViews& set);
    /// Whether a pass knows the outliers of the batch: the last one of an odd number, which one rank has.
    [[nodiscard]] bool knows_all(std::uint32_t pass) const {
        return passes() % 2 == 1 && pass + 1 == passes();
    }
    /// Count the outliers of a pass, and add the gradients of its terms if it knows all.
    Status take_scales(std::uint32_t pass, Outliers& outliers);
    /// Add the gradients of the terms to those of the network's scales.
    Status add_to_gradients(std::span<const float> scales, const ScaleOutliers& batch);
    /// Run passes that have outliers but did not know all once more, for the gradients of the terms alone.
    Status repeat_for_scales(const TrainBatch& batch, const Outliers& outliers, TrainStep& result);
    Status repeat_for_scales(const TrainBatch& batch, std::uint32_t first, const ScaleOutliers& all,
                             TrainStep& result, const nn::BetweenParts& between);

    // scene_planes.cpp
    Status build_planes();
    /// Fill members_.
    Status find_planes(const TrainBatch& batch);

    // cycle.cpp
    struct CycleInputs;
    Status check_cycle(const model::ModelConfig& network) const;
    Status build_cycle(const raster::RasterDesc& object);
    [[nodiscard]] bool cycles_now() const;
    Status draw_cycle(const TrainBatch& batch, CycleInputs& made, TrainStep& result);
    Status attempt_cycle(const TrainBatch& batch, Unread& made, bool read);

    vk::Context& context_;
    config::TrainConfig config_;
    run::Group* group_;      ///< null: one rank
    std::uint32_t objects_;  ///< objects of a batch on this rank
    std::unique_ptr<model::Model> model_;
    std::optional<GradientSum> gradients_;
    std::unique_ptr<Optimiser> optimiser_;
    std::unique_ptr<raster::Rasterizer> rasterizer_;
    std::unique_ptr<RenderLoss> loss_;
    std::optional<SizeMap> sizes_;     ///< where edges are weighed by size
    std::vector<ScenePlanes> planes_;  ///< one per object of a pass, where planes count
    std::vector<PlaneMembers>
        members_;              ///< planes of each object of the batch; empty without the loss
    std::uint32_t drawn_ = 1;  ///< objects of a rasterizer call
    Status entered_;           ///< what the latest enter() gave
    gaussians::GaussianSet scene_, grad_scene_;  ///< a call's, in passes of several calls
    /// Cycles: a drawer of views; what is predicted first, of all objects; lists that copy it there, and to scene_.
    std::unique_ptr<raster::Rasterizer> drawer_;
    gaussians::GaussianSet detached_;
    std::vector<vk::CommandList> keep_, join_;
    bool cycling_ = false;
    vk::Buffer grad_image_, grad_depth_;
    std::vector<vk::CommandList> copy_in_, copy_out_;  ///< one per call of such a pass
    /// Keep an object's losses, or a pass's counts of the network's output: the optimiser's notes.
    std::vector<vk::CommandList> note_losses_, note_counts_;
    vk::Batch batch_;
    std::deque<Unread> unread_;
    std::deque<TrainStep> results_;
    std::atomic<std::uint64_t> steps_ = 0;  ///< steps of optimiser_
    std::atomic<std::uint64_t> attempts_ = 0, attempts_read_ = 0, skipped_in_a_row_ = 0;
    mutable std::mutex last_mutex_;  ///< guards last_
    std::optional<TrainStep> last_;
};

}  // namespace splat::train
