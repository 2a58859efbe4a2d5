#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/train_config.h"
#include "io/weights_file.h"
#include "nn/parameters.h"
#include "ops/ema.h"

namespace splat::train {

/// What is wrong with the gradients of a step.
struct GradientStats {
    std::uint64_t non_finite = 0;  ///< NaN and infinite numbers
    bool zero = true;              ///< all of them, so that a step teaches nothing
};

/// Adam's numbers for a group of parameters.
struct OptimiserRule {
    double rate_factor = 1;  ///< multiplies the step's rate
    std::array<double, 2> betas = {0.9, 0.999};
    double eps = 1e-15;
};

/// A float32 parameter, its gradient of the same size, and the rule that updates it. Its first dimension counts
/// rows, of which gather_rows() may leave fewer than the memory holds: `shape` and the views are of those in use.
struct OptimiserParameter {
    std::string name;
    Shape shape;
    vk::BufferView value, grad;
    std::size_t rule = 0;
    /// Neighbours of one block and rule are updated in one dispatch, with the padding between them; 0: alone.
    std::size_t block = 0;
    std::uint32_t capacity = 0;  ///< rows that the memory holds; set by Optimiser::create

    /// `shape` with another number of rows, and a view of as many.
    [[nodiscard]] Shape shape_of(std::uint32_t rows) const;
    [[nodiscard]] vk::BufferView rows_of(vk::BufferView view, std::uint32_t rows) const;
    [[nodiscard]] std::uint32_t rows() const { return shape.rank() == 0 ? 1 : shape[0]; }
};

/// What the caller keeps of a step beside the decision: bytes of OptimiserDesc::notes, written on the device.
struct OptimiserNotes {
    std::uint64_t bytes = 0;
    std::uint64_t checked =
        0;  ///< bytes, from the first on, of blocks of losses, which must be finite
    std::uint64_t block = 16;     ///< bytes of a block; all are multiples of 16
    std::uint64_t unchecked = 0;  ///< first bytes of a block, which may hold any numbers
};

struct OptimiserDesc {
    std::vector<OptimiserParameter> parameters;
    std::vector<OptimiserRule> rules = {OptimiserRule()};
    /// The rate of a step: learning_rate, schedule, warmup, iterations and step_lr_at.
    config::TrainConfig schedule;
    std::optional<ops::EmaSchedule> ema;      ///< empty: no averages
    std::vector<nn::Parameters*> containers;  ///< told of changes; they must outlive the optimiser
    OptimiserNotes notes;
    std::uint32_t most_unread = 1;  ///< steps between two reads
};

/// Append the trainable parameters of `from`, named `prefix` and their name, and `from` itself. Errors:
/// kInvalidState if it was made without gradients.
Status add_parameters(OptimiserDesc& desc, nn::Parameters& from, const std::string& prefix = "");

struct OptimiserStep {
    std::uint64_t step = 0;     ///< updates done
    std::uint64_t skipped = 0;  ///< calls that updated nothing
    double rate = 0;            ///< rate of this update; of the next one if it was skipped
    GradientStats gradients;
    bool was_skipped = false;
};

/// A step that was read, with its notes.
struct OptimiserRead {
    OptimiserStep step;
    std::span<const std::uint32_t> notes;
};

/// Stands for a row that is not one of those in use.
inline constexpr std::int64_t kNewRow = -1;

/// Adam with an exponential moving average of the parameters, a schedule of the rate, and rows that can be
/// reordered, dropped and added.
///
/// The device decides whether a step updates, and keeps what became of it until read(). Counters, rates, averages and
/// states are those of the steps read.
///
/// Errors       kOutOfDeviceMemory; those of Context::run, after which parameters are undefined
/// Precision    see ops/adam.h, ops/ema.h
/// Determinism  bit-exact for any thread count
class Optimiser {
  public:
    /// The parameters' memory must outlive it. Moments start at zero; the average starts with the first
    /// update of its schedule.
    ///
    /// Errors: kInvalidArgument for a rule outside Adam's range, kShape for a gradient of another size than
    /// its parameter.
    static Result<Optimiser> create(vk::Context& context, OptimiserDesc desc);

    /// Set all gradients to zero, also those of rows that are not in use.
    Status zero_gradients();

    /// Takes what became of all unread steps, in their order. If it throws, they stay unread.
    using Use = std::function<void(std::span<const OptimiserRead>)>;

    /// One update from the gradients, at the schedule's rate; nothing is updated if the loss, one in the notes or a
    /// gradient is not finite. It runs with what was noted before it, and is not cancelled once it began. With `use`
    /// all that is unread is read in the same list, or in another where staging memory is short. An update that ran
    /// counts in unread(), whatever fails after it. Errors: kInvalidArgument for a rate that is negative or not finite.
    Status step(double loss = 0, const Use& use = {});
    Status step(OptimiserStep& result);

    /// Read the steps since the last read; without any, nothing is called.
    Status read(const Use& use);

    /// Steps since the last read; where they are most_unread, they must be read before the next.
    [[nodiscard]] std::uint32_t unread() const { return unread_; }
    [[nodiscard]] bool full() const { return unread_ == desc_.most_unread; }

    /// Where notes are written before step().
    [[nodiscard]] const vk::BufferView& notes() const { return notes_.range(); }

    /// Replace the rows of parameters that have equally many: row i becomes row rows[i] with its moments and
    /// average. For kNewRow it is row i as it lies in the parameter's memory, where the caller wrote it, with
    /// moments of zero and itself as the average. Gradients stay. All or nothing, except for errors of
    /// Context::run.
    ///
    /// Errors: kInvalidArgument for no parameter, no rows, more than the memory holds, or a row that is not in use;
    /// kShape for parameters that differ in rows or capacity; kUnsupported for parameters of a network.
    Status gather_rows(std::span<const std::size_t> parameters, std::span<const std::int64_t> rows);

    /// Updates done, and calls of step() that updated nothing.
    [[nodiscard]] std::uint64_t steps() const { return steps_; }
    [[nodiscard]] std::uint64_t skipped() const { return skipped_; }

    /// Rate of the next update.
    [[nodiscard]] double rate() const { return desc_.schedule.rate(steps_ + 1); }
    /// Replace the rate that the schedule scales.
    void set_rate(double rate) { desc_.schedule.learning_rate = rate; }

    [[nodiscard]] const std::vector<OptimiserParameter>& parameters() const {
        return desc_.parameters;
    }

    [[nodiscard]] bool averages() const { return desc_.ema.has_value(); }

    // optimiser_state.cpp
    /// Copy a parameter's averaged values, or without averages its own.
    Status read_average(const OptimiserParameter& parameter, LargeVector<float>& values);

    /// The same of all parameters, by name.
    Result<io::NamedTensors> averaged();

    /// Moments and averages as "m:NAME", "v:NAME" and "ema:NAME".
    Status save(io::NamedTensors& tensors);

    /// Check the state to load. Errors: kInvalidArgument for a tensor that is missing or of another size.
    Status check(const io::WeightsFile& file) const;

    /// Load the state; errors as check().
    Status load(const io::WeightsFile& file, std::uint64_t steps);

    /// Everything that the next step depends on except parameters and gradients: moments, averages, counts of
    /// rows and counters, with the rate.
    Result<io::WeightsFile> state();

    /// Go on from such a state, bit-exactly. All or nothing. Errors: kInvalidArgument for another kind of file,
    /// or the state of other parameters.
    Status load_state(const io::WeightsFile& file);

  private:
    /// What is updated of a run.
    struct Used {
        vk::BufferView values, grads;
        std::uint64_t elements = 0;  ///< gradients to measure
    };
    /// Parameters that one dispatch updates, and their state in the layout of the values.
    struct Run : Used {
        std::size_t rule = 0;
        vk::Buffer m, v, average;
        vk::BufferView partial;  ///< part of partial_
    };
    /// Other numbers of rows in use: the runs, and the list for them.
    struct Rows {
        std::vector<Used> runs;
        vk::CommandList list;
    };
    struct Kind {
        const char* prefix;
        vk::Buffer Run::*buffer;
    };
    [[nodiscard]] std::vector<Kind> kinds() const;
    Optimiser(vk::Context& context, OptimiserDesc desc)
        : context_(&context), desc_(std::move(desc)) {}
    void make_runs();
    Status allocate();
    Result<vk::CommandList> record(std::span<const Used> runs);
    [[nodiscard]] vk::BufferView ema_scalars() const;
    [[nodiscard]] std::uint64_t row_bytes() const { return 16 + desc_.notes.bytes; }
    [[nodiscard]] std::vector<Used> used() const { return {runs_.begin(), runs_.end()}; }
    Status write_inputs(double loss);
    Status read_later(std::uint32_t rows, const Use& use);
    /// What rows of the history say, if they follow the steps that were read.
    void explain(std::span<const std::uint32_t> rows, std::span<OptimiserRead> steps) const;
    Status read(const vk::BufferView& view, LargeVector<float>& values);
    /// The part of its run's buffer that belongs to parameter `index`.
    [[nodiscard]] vk::BufferView part(std::size_t index, vk::Buffer Run::*buffer) const;

    // optimiser_rows.cpp
    Status check_rows(std::span<const std::size_t> parameters,
                      std::span<const std::int64_t> rows) const;
    Result<vk::CommandList> record_gather(std::span<const std::size_t> parameters,
                                          const vk::BufferView& rows, const vk::BufferView& before);
    /// What use_rows() takes, for rows[i] rows of parameters[i]; changes nothing.
    Result<Rows> make_rows(std::span<const std::size_t> parameters,
                           std::span<const std::uint32_t> rows);
    /// Set how many rows of parameters are in use.
    void use_rows(std::span<const std::size_t> parameters, Rows rows) noexcept;

    vk::Context* context_;
    OptimiserDesc desc_;
    std::vector<Run> runs_;
    std::vector<std::size_t> run_of_;  ///< by parameter
    vk::CommandList list_;             ///< measures, decides and updates
    vk::Buffer scalars_;  ///< scalars of a step: those of Adam by rule, then of averages
    vk::Buffer partial_, notes_, inputs_, history_;  ///< see ops::StepDecision
    std::uint32_t unread_ = 0;
    std::unique_ptr<vk::Batch> batch_ = std::make_unique<vk::Batch>();
    std::uint64_t steps_ = 0, skipped_ = 0;
};

}  // namespace splat::train
