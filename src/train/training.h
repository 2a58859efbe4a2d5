#pragma once

#include <chrono>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>

#include "core/interrupt.h"
#include "eval/scores.h"
#include "predict/predictor.h"
#include "train/batches.h"
#include "train/run_folder.h"
#include "train/run_record.h"

namespace splat::train {

struct TrainingDesc {
    std::string folder;
    RunFolder::Mode mode = RunFolder::Mode::kNew;
    /// YAML or JSON; none: the defaults, or of the run that is resumed.
    std::optional<std::string> config;
    std::vector<std::string> changes;  ///< to it, "key=value"
    /// Null: the splits train and val of data.root. With `dataset` given, null: no validation.
    std::shared_ptr<data::Dataset> dataset, validation;
    std::string init;  ///< file of weights to start from; empty: opt.pretrained_ckpt, else random
    model::LoadOptions init_options;
    std::string library;  ///< version of the library, for run.json
};

enum class EventKind {
    kMessage,          ///< only a text
    kStep,             ///< one attempt of a step
    kValidatedObject,  ///< one object of a validation
    kValidation,       ///< the scores of a validation
    kCheckpoint,       ///< a state was saved
    kDone,             ///< all steps are done, and everything is saved
    kInterrupted,      ///< by interrupt(), and everything is saved
    kNotFinite,        ///< failed: steps in a row had a loss or gradients that are not finite
    kNothingDrawn,     ///< failed: steps in a row drew nothing
};

/// What a call of Training::next() did.
struct Event {
    EventKind kind = EventKind::kMessage;
    std::string text;  ///< text that was written to log.txt; or empty
    bool warning = false;
    std::uint64_t step = 0, attempts = 0, iterations = 0, skipped = 0;
    std::uint64_t peak_bytes = 0;

    TrainStep result;  ///< result of a step
    bool logged = false;
    double psnr = 0;
    double averaged_loss = NAN;  ///< over the latest steps; NaN before one of this session
    double seconds = 0, steps_per_second = 0;

    std::uint32_t object = 0, objects = 0;  ///< in a validation
    eval::ObjectScores scores;              ///< scores of the object
    std::vector<float> images, truths;      ///< images of the object, [n,3,R,R], input views first
    std::uint32_t inputs = 0;               ///< how many of them are input views
    eval::Scores novel, conditioning;       ///< means over the objects
    double best_psnr = 0;                   ///< best validation with as many objects and views
};

/// A training with its folder, from its first step or the latest state to its end, one piece of work per
/// call. A run that ends anywhere and is resumed has the same bits as one without an interruption.
///
/// Not thread-safe. Locks the context's mutex around each step of training, each operation of a
/// validation and each copy of weights, never while it reads or writes files.
class Training {
  public:
    /// Check everything that can be checked before the first step, then make or lock the folder. Errors, all
    /// but the last before anything is written:
    ///   kInvalidArgument  the configuration; a key or data that differ from the run's and may not change
    ///   kInvalidState     as RunFolder::open()
    ///   kNotFound, kFormat, kShape  the data, the weights to start from, or a run's states, none of which can
    ///                     be read; a run that ended before its first state begins again
    ///   kIo               the folder cannot be written
    ///
    /// Raising `interrupt`, which must outlive the session, ends it at the next call of next().
    static Result<std::unique_ptr<Training>> open(std::shared_ptr<vk::Context> context,
                                                  const TrainingDesc& desc,
                                                  const Interrupt& interrupt);
    ~Training();
    Training(const Training&) = delete;
    Training& operator=(const Training&) = delete;

    /// Do the next piece of work. After the end it gives the last event again, without text. After an error,
    /// which log.txt and run.json keep, the next call tries the same piece again, or writes what it did.
    Status next(Event& event);

    [[nodiscard]] RunFigures figures() const;
    [[nodiscard]] const std::shared_ptr<Trainer>& trainer() const { return trainer_; }
    [[nodiscard]] const config::Settings& settings() const { return settings_; }

  private:
    struct Validation {
        std::vector<eval::ObjectScores> scores;
        io::WeightsFile weights;
    };

    /// What a piece of work did, with lines that are still to be written.
    struct Untold {
        Event event;
        std::string metric;  ///< line of metrics.jsonl; event.text is that of log.txt
    };

    /// What needs the context's mutex to be destroyed.
    struct OnDevice : vk::DeferredWork {
        std::shared_ptr<Trainer> trainer;
        std::unique_ptr<predict::Predictor> predictor;
    };

    Training(std::shared_ptr<vk::Context> context, const Interrupt& interrupt)
        : context_(std::move(context)),
          interrupt_(interrupt),
          left_(std::make_unique<OnDevice>()) {}

    /// Call `body` with the device locked. Errors: also those of DeviceMutex::check().
    template <class Body>
    Status on_device(Body&& body) {
        const std::lock_guard lock(context_->mutex);
        SPLAT_TRY(context_->mutex.check());
        return body();
    }

    // training_open.cpp
    Status configure(const TrainingDesc& desc);
    Status open_data(const TrainingDesc& desc);
    Status check_validation();
    Status start();
    /// `options`: none: grafted from the likely channels of the file.
    Status load_weights(const std::string& path, const std::optional<model::LoadOptions>& options);
    Status resume();
    Status restore_validations();
    Status warn_of_cameras();
    [[nodiscard]] Status check_batches(const BatchSource& source) const;
    Status begin(const TrainingDesc& desc);

    // training.cpp
    Status work(Event& event);
    Status tell(Event& event);
    Status step(Event& event);
    Status after_step(const TrainStep& result, Event& event);
    Status save(Event& event);
    Status validate(Event& event);
    Status begin_validation();
    Status end_validation(Event& event);
    Status end(EventKind kind, Event& event);
    Status write_run(const char* state) const;
    [[nodiscard]] bool is_validation_due() const;
    [[nodiscard]] std::uint32_t validated_objects() const;
    [[nodiscard]] double seconds() const;
    [[nodiscard]] std::uint64_t peak_bytes() const;

    std::shared_ptr<vk::Context> context_;
    config::Settings settings_;
    std::string config_;  ///< all of it, as JSON
    Start start_;
    std::string library_;
    std::unique_ptr<RunFolder> folder_;
    std::shared_ptr<const predict::ViewSource> data_, validation_;
    std::shared_ptr<Trainer> trainer_;
    std::unique_ptr<predict::Predictor> predictor_;  ///< for validation; made when first needed
    PrefetchPointer batches_;
    std::deque<std::pair<std::string, bool>>
        messages_;  ///< messages of open(), and whether each is a warning
    std::vector<std::filesystem::path> unreadable_;  ///< states
    std::string error_;                              ///< error of the latest next(), as in run.json
    std::optional<Validation> validating_;
    std::optional<Untold> untold_;  ///< more than a moment only after an error
    std::optional<EventKind> ended_;
    std::uint64_t step_ = 0, skipped_ = 0;
    std::uint64_t saved_ = ~std::uint64_t{0};      ///< step of the latest state
    std::uint64_t validated_ = ~std::uint64_t{0};  ///< step of the latest validation
    std::uint64_t skipped_in_a_row_ = 0, not_drawn_in_a_row_ = 0;
    double best_psnr_ = 0;
    double last_psnr_ = NAN;                   ///< until a validation of the run
    double loss_ = NAN, averaged_loss_ = NAN;  ///< until a step of this process
    std::optional<std::chrono::steady_clock::time_point>
        begun_;  ///< the first step of this process
    std::uint64_t begun_at_ = 0;
    const Interrupt& interrupt_;
    const std::uint64_t raised_before_ = interrupt_.count();
    std::unique_ptr<OnDevice> left_;  ///< made beforehand, because a destructor must not fail
};

}  // namespace splat::train
