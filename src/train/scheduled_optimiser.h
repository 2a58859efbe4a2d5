#pragma once

#include <memory>

#include "config/train_config.h"
#include "io/weights_file.h"
#include "train/optimiser.h"

namespace splat::train {

struct ScheduledStep {
    std::uint64_t step = 0;     ///< updates done
    std::uint64_t skipped = 0;  ///< calls that updated nothing
    double rate = 0;            ///< rate of this update; of the next one if it was skipped
    GradientStats gradients;
    bool was_skipped = false;
};

/// An optimiser with a schedule of its rate, which skips updates whose gradients are not finite.
class ScheduledOptimiser {
  public:
    /// `schedule` gives learning_rate, schedule, warmup, iterations and step_lr_at.
    ScheduledOptimiser(Optimiser optimiser, config::TrainConfig schedule)
        : optimiser_(std::move(optimiser)), schedule_(std::move(schedule)) {}

    /// Errors: those of Optimiser.
    Status step(ScheduledStep& result);

    /// Replace the rate that the schedule scales.
    void set_rate(double rate) { schedule_.learning_rate = rate; }

    [[nodiscard]] std::uint64_t skipped() const { return skipped_; }
    /// Rate of the next update.
    [[nodiscard]] double rate() const { return schedule_.rate(optimiser_.steps() + 1); }
    [[nodiscard]] Optimiser& optimiser() { return optimiser_; }

    /// Everything that the next step depends on except parameters and gradients: moments, averages and
    /// counters, with the rate.
    Result<io::WeightsFile> state();

    /// Go on from such a state, bit-exactly. All or nothing.
    ///
    /// Errors: kInvalidArgument for another kind of file, or the state of other parameters.
    Status load(const io::WeightsFile& file);

    /// The averaged parameters by name, or the current ones without averages.
    Result<io::NamedTensors> averages();

  private:
    Optimiser optimiser_;
    config::TrainConfig schedule_;
    std::uint64_t skipped_ = 0;
};

}  // namespace splat::train
