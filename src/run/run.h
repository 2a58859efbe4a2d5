#pragma once

#include <cmath>
#include <memory>
#include <optional>

#include "core/interrupt.h"
#include "core/os/path.h"
#include "core/stopwatch.h"
#include "run/leader.h"
#include "run/run_folder.h"
#include "run/task.h"

namespace splat::run {

struct RunDesc {
    std::string folder;
    RunFolder::Mode mode = RunFolder::Mode::kNew;
    std::string library;  ///< version of the library, for run.json
    /// The ranks of the run, of which this is 0; it must outlive the run. Others open a Follower. Null: none.
    Group* group = nullptr;
};

enum class EventKind {
    kMessage,         ///< only a text
    kStep,            ///< one attempt of a step
    kValidatedPiece,  ///< one piece of a validation
    kValidation,      ///< the scores of a validation
    kCheckpoint,      ///< a state was saved
    kDone,            ///< all steps are done, and everything is saved
    kInterrupted,     ///< by the interrupt, and everything is saved
    kNotFinite,  ///< failed: losses, gradients or what a step learned are not finite; the task has the last
                 ///< state again
    kNothingDrawn,  ///< failed: steps in a row drew nothing
};

/// What a call of Run::next() did.
struct Event {
    EventKind kind = EventKind::kMessage;
    std::string text;  ///< text that was written to log.txt; or empty
    bool warning = false;
    bool updated = false;  ///< by a step
    bool logged = false;   ///< metrics.jsonl got a line of the step
    std::uint64_t step = 0, attempts = 0, iterations = 0, skipped = 0;
    std::uint64_t peak_bytes = 0;
    double seconds = 0, steps_per_second = 0;
    Numbers numbers;
    std::uint32_t piece = 0, pieces = 0;  ///< in a validation
    Piece validated;                      ///< piece whose scores are `numbers`
};

/// The figures of a run that its reports share.
struct Figures {
    std::string folder;
    std::uint64_t step = 0, iterations = 0;
    std::uint64_t skipped = 0;  ///< attempts that updated nothing
    double loss = NAN;          ///< loss of the latest step of this process
    double validation_psnr = NAN, validation_ssim = NAN, best_validation_psnr = 0;
    std::uint64_t peak_bytes = 0;   ///< most device memory so far
    std::optional<Numbers> ledger;  ///< ledger of the latest attempt of this process
};

/// JSON: {"schema", "folder", "step", "iterations", "skipped", "loss", "val_psnr", "val_ssim", "best_val_psnr",
/// "peak_bytes", "ledger"}.
std::string figures_json(const Figures& figures);

/// Work that is done one piece per call.
class Work : NoCopy {
  public:
    virtual ~Work() = default;
    /// Do the next piece. After the end it gives the last event again, without text.
    virtual Status next(Event& event) = 0;
    [[nodiscard]] virtual Figures figures() const = 0;
};

/// A task with its folder, from its first step or the latest state to its end, one piece of work per call. A call may
/// do several steps, which it and later calls tell one by one; a state is saved after the last one of them. A run that
/// ends anywhere and is resumed has the same bits as one without an interruption. Not thread-safe.
class Run : public Work {
  public:
    /// Check everything that can be checked before the first step, then make or lock the folder. Errors, all
    /// but the last before anything is written:
    ///   those of the task
    ///   kInvalidState     as RunFolder::open()
    ///   kNotFound         none of a run's states can be read; a run that ended before its first state begins again
    ///   kIo               the folder cannot be written
    ///   those of any rank, with its number before the sentence
    ///
    /// Raising `interrupt`, which must outlive the run, ends it at the next call of next().
    static Result<std::unique_ptr<Run>> open(const RunDesc& desc, std::unique_ptr<Task> task,
                                             const Interrupt& interrupt);

    /// Do the next piece of work. After the end it gives the last event again, without text. After an error,
    /// which log.txt and run.json keep unless it is kCancelled, the next call tries the same piece again, or writes
    /// what it did. In a run of several ranks an error, which may be another rank's, ends the run on all.
    Status next(Event& event) override;

    [[nodiscard]] Figures figures() const override;

  private:
    /// What a piece of work did, with lines that are still to be written.
    struct Untold {
        Event event;
        std::string metric;  ///< line of metrics.jsonl; event.text is that of log.txt
    };

    Run(RunDesc desc, std::unique_ptr<Task> task, const Interrupt& interrupt)
        : desc_(std::move(desc)),
          leader_(desc_.group),
          task_(std::move(task)),
          interrupt_(interrupt) {}

    // run_open.cpp
    Status open();
    Status start(std::vector<std::string> record);
    Status resume();
    Status restore_validations();
    Status begin();

    // run.cpp
    Status work(Event& event);
    Status tell(Event& event);
    Status step(Event& event);
    Status after_step(const Step& done, Event& event);
    [[nodiscard]] std::uint64_t most_steps() const;
    Status save(Event& event);
    Status validate(Event& event);
    Status end_validation(Event& event);
    Status go_back();
    Status end(EventKind kind, Event& event);
    Status write_run(const char* state) const;
    [[nodiscard]] bool is_validation_due() const;
    [[nodiscard]] double seconds() const;

    RunDesc desc_;
    Leader leader_;
    std::unique_ptr<RunFolder> folder_;
    std::unique_ptr<Task> task_;
    Plan plan_;
    Messages messages_;                              ///< messages of open(), still to be told
    std::vector<std::filesystem::path> unreadable_;  ///< states
    std::string error_;                              ///< error of the latest next(), as in run.json
    std::optional<std::vector<NamedWeights>> validated_results_;  ///< while a validation goes on
    std::uint32_t piece_ = 0;                                     ///< the next one
    std::optional<Untold> untold_;  ///< more than a moment only after an error
    std::optional<EventKind> ended_;
    double each_seconds_ = 0;  ///< time of each step among those done together
    std::deque<Step> done_;    ///< steps that are still to be told
    std::uint64_t step_ = 0, attempts_ = 0, skipped_ = 0;  ///< counts of what was told
    static constexpr std::uint64_t kNotSaved = ~std::uint64_t{0};
    std::uint64_t saved_ = kNotSaved;              ///< step of the latest state
    std::uint64_t validated_ = ~std::uint64_t{0};  ///< step of the latest validation
    std::uint64_t skipped_in_a_row_ = 0, not_drawn_in_a_row_ = 0;
    double best_psnr_ = 0;
    double last_psnr_ = NAN, last_ssim_ = NAN;  ///< until a validation of the run
    double loss_ = NAN, averaged_loss_ = NAN;   ///< until a step of this process
    std::optional<Numbers> ledger_;
    std::optional<Stopwatch> begun_;  ///< since the first step of this process
    std::uint64_t begun_at_ = 0;
    const Interrupt& interrupt_;
    const std::uint64_t raised_before_ = interrupt_.count();
};

}  // namespace splat::run
