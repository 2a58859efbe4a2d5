// Stages: a trainer that goes on with other batches, losses and targets. Weights, moments, averages and counts of
// updates stay; all else is made anew, as in a session that resumes in the stage.

#include "config/stages.h"
#include "config/config_file.h"
#include "core/number_in.h"
#include "train/splatter_training.h"

namespace splat::train {
namespace {

/// Key of a state's metadata: objects that batches had.
constexpr const char* kObjectsKey = "objects";

}  // namespace

Status Trainer::enter(const config::TrainConfig& stage) {
    SPLAT_TRY(read());
    SPLAT_TRY(check_stage(stage, group_));
    io::WeightsFile kept;
    SPLAT_TRY(optimiser_->save(kept.tensors));
    config_ = stage;
    objects_ = config_.batch_size / (group_ == nullptr ? 1 : group_->count());
    batch_ = vk::Batch();
    optimiser_.reset();
    loss_.reset();
    sizes_.reset();
    planes_.clear();
    rasterizer_.reset();
    drawer_.reset();
    gradients_.reset();
    for (auto* const lists : {&copy_in_, &copy_out_, &keep_, &join_, &note_losses_, &note_counts_})
        lists->clear();
    entered_ = check_cycle(model_->config());
    if (entered_.ok()) entered_ = build_stage();
    if (entered_.ok()) entered_ = optimiser_->load(kept, steps_);
    return entered_;
}

Status SplatterTraining::in_stage(std::size_t stage, const Status& error) {
    return {error.code(), config::stage_name("configuration", stage) + ": " + error.message()};
}

/// Build what each stage needs, the first one last, so that what a later one lacks is found before the first step.
Status SplatterTraining::try_stages() {
    const config::TrainConfig& c = settings_.training;
    for (std::size_t i = c.stages.size(); i-- > 0;)
        if (const Status entered = enter(i); !entered.ok()) return in_stage(i, entered);
    return {};
}

Status SplatterTraining::enter(std::size_t stage) {
    if (stage == stage_) return {};
    SPLAT_TRY(
        context_->mutex.call([&] { return trainer_->enter(settings_.training.in_stage(stage)); }));
    stage_ = stage;
    return {};
}

/// Errors: on all ranks those of any.
Status SplatterTraining::enter_next() {
    const std::size_t next = settings_.training.stage_after(trainer_->steps());
    if (next == stage_ && batches_ != nullptr) return {};
    first_batch_ = {trainer_->attempts(), objects_so_far()};
    batches_.reset();
    const auto go_on = [&]() -> Status {
        SPLAT_TRY(enter(next));
        return open_batches(false);
    };
    Status entered = go_on();
    if (group() != nullptr) entered = group()->agree(entered);
    if (!entered.ok()) batches_.reset();
    return entered;
}

std::uint64_t SplatterTraining::objects_so_far() const {
    const std::uint64_t each = trainer_->config().batch_size;
    return first_batch_.object + (trainer_->attempts() - first_batch_.number) * each;
}

/// The state of a training with stages says also how many objects its batches had.
void SplatterTraining::note_stages(io::WeightsFile& state) const {
    if (settings_.training.stages.empty()) return;
    for (auto& [name, text] : state.metadata)
        if (name == "config") text = config::merged_config_text(settings_);
    state.metadata.emplace_back(kObjectsKey, std::to_string(objects_so_far()));
}

Status SplatterTraining::load_stages(const io::WeightsFile& state) {
    if (settings_.training.stages.empty()) return {};
    std::optional<std::uint64_t> steps, objects, attempts;
    for (const auto& [name, text] : state.metadata) {
        if (name == "step") steps = number_in<std::uint64_t>(text);
        if (name == "attempts") attempts = number_in<std::uint64_t>(text);
        if (name == kObjectsKey) objects = number_in<std::uint64_t>(text);
    }
    if (!steps || !attempts || !objects)
        return damaged(
            "checkpoint: no numbers 'step', 'attempts' and 'objects' in its metadata: the file is "
            "not a state of a training with 'opt.stages'");
    first_batch_ = {*attempts, *objects};
    return enter(settings_.training.stage_after(*steps));
}

}  // namespace splat::train
