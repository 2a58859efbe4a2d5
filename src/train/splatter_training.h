#pragma once

#include <memory>
#include <optional>

#include "eval/scores.h"
#include "predict/predictor.h"
#include "run/run.h"
#include "train/batches.h"
#include "train/training_facts.h"

namespace splat::train {

struct TrainingDesc {
    /// YAML or JSON; none: the defaults, or of the run that is resumed.
    std::optional<std::string> config;
    std::vector<std::string> changes;  ///< to it, "key=value"
    /// Null: the splits train and val of data.root. With `dataset` given, null: no validation.
    std::shared_ptr<data::Dataset> dataset, validation;
    std::string init;  ///< file of weights to start from; empty: opt.pretrained_ckpt, else random
    model::LoadOptions init_options;
    run::Group* group = nullptr;  ///< the ranks of the run; null: no others
};

/// Training of Splatter Image, as the task of a run.
///
/// Locks the context's mutex around each step of training, each operation of a validation and each copy of weights,
/// never while it reads or writes files. Errors of prepare(), start() and begin():
///   kInvalidArgument  the configuration; a key that differs from the run's and may not change
///   kNotFound, kFormat, kShape  the data, or the weights to start from
class SplatterTraining : public run::Task {
  public:
    SplatterTraining(std::shared_ptr<vk::Context> context, TrainingDesc desc)
        : context_(std::move(context)),
          desc_(std::move(desc)),
          left_(std::make_unique<OnDevice>()) {}
    ~SplatterTraining() override;

    // splatter_training_open.cpp
    Result<run::Plan> prepare(const run::ReadText* config, run::Messages& messages) override;
    /// Configuration and data. Places may differ: what lies there is compared.
    Result<run::RankFacts> facts() override;
    Status start(run::Messages& messages) override;
    Status recall(const JsonTree& run_json, const std::string& path) override;
    Status compare(const JsonTree& run_json, run::Messages& messages) override;
    Status load(const io::WeightsFile& state) override;
    Status begin() override;

    // splatter_training.cpp
    Status step(std::uint64_t most, std::deque<run::Step>& done) override;
    Status begin_validation(const std::vector<run::NamedWeights>& results) override;
    Status validate(std::uint32_t piece, run::Piece& done) override;
    [[nodiscard]] run::Validation validation() const override;
    Result<io::WeightsFile> state() override;
    Result<std::vector<run::NamedWeights>> results() override;
    [[nodiscard]] run::Progress progress() const override;
    [[nodiscard]] std::uint64_t peak_bytes() const override;
    [[nodiscard]] std::string headline(const std::string& folder) const override;
    void describe(JsonWriter& json) const override;

    [[nodiscard]] const std::shared_ptr<Trainer>& trainer() const { return trainer_; }
    [[nodiscard]] const config::Settings& settings() const { return settings_; }

  private:
    /// What needs the context's mutex to be destroyed.
    struct OnDevice : vk::DeferredWork {
        std::shared_ptr<Trainer> trainer;
        std::unique_ptr<predict::Predictor> predictor;
    };

    Status configure(const run::ReadText* config, run::Messages& messages);
    Status open_data(run::Messages& messages);
    Status check_validation() const;
    Status warn_of_cameras(run::Messages& messages) const;
    /// Reads the weights to start from and checks their names and shapes, before the network takes memory.
    Status read_start(run::Messages& messages);
    /// `options`: none: grafted from the likely channels of the file.
    Status read_weights(const std::string& path, const std::optional<model::LoadOptions>& options);
    [[nodiscard]] Status check_batches(const BatchSource& source) const;
    /// Null where this rank is the only one.
    [[nodiscard]] run::Group* group() const {
        return desc_.group == nullptr || desc_.group->count() == 1 ? nullptr : desc_.group;
    }
    [[nodiscard]] std::uint32_t validated_objects() const;
    /// Do a step with the next batch.
    Status attempt(bool read);
    [[nodiscard]] run::Step step_of(const TrainStep& done) const;
    Status open_batches(bool check);

    // stages.cpp
    static Status in_stage(std::size_t stage, const Status& error);
    Status try_stages();
    Status enter(std::size_t stage);
    Status enter_next();
    /// Objects that the batches so far had.
    [[nodiscard]] std::uint64_t objects_so_far() const;
    void note_stages(io::WeightsFile& state) const;
    Status load_stages(const io::WeightsFile& state);

    std::shared_ptr<vk::Context> context_;
    TrainingDesc desc_;
    config::Settings settings_;
    Start start_;
    /// Between read_start() and start().
    struct {
        std::string path;
        model::LoadOptions options;
        io::NamedTensors tensors;
    } first_weights_;
    std::shared_ptr<const predict::ViewSource> data_, validation_;
    std::shared_ptr<Trainer> trainer_;
    std::unique_ptr<predict::Predictor> predictor_;  ///< for validation; made when first needed
    PrefetchPointer batches_;
    std::size_t stage_ = 0;
    /// The first batch of the stage or the session, see BatchSource::begin_at().
    struct {
        std::uint64_t number = 0, object = 0;
    } first_batch_;
    std::uint64_t told_ = 0;                  ///< attempts that step() gave
    std::deque<std::uint64_t> peaks_;         ///< peak_bytes() of those that follow
    std::vector<eval::ObjectScores> scores_;  ///< scores of the validation that goes on
    std::unique_ptr<OnDevice> left_;  ///< made beforehand, because a destructor must not fail
};

}  // namespace splat::train
