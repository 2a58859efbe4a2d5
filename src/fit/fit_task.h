#pragma once

#include <functional>
#include <memory>

#include "fit/first_gaussians.h"
#include "fit/fit_memory.h"
#include "fit/fit_options.h"
#include "fit/scene_scores.h"
#include "run/task.h"

namespace splat::fit {

/// A fit of Gaussians to photographs, as the task of a run. Its result is "gaussians": the arrays of
/// scene::Gaussians by their names, in the photographs' frame.
///
/// Takes at most FitOptions::memory of the device, beside what others had when it was opened. Memory that runs out in a
/// step ends growth, then a step draws one view; only then the step fails.
///
/// Locks the context's mutex around each step, each view of a validation and each copy of the Gaussians.
/// Errors       those of options_of(), options_of_run(), load_posed_photos() and Fitter; kInvalidArgument for other
///              photographs than the run's
class FitTask : public run::Task {
  public:
    FitTask(std::shared_ptr<vk::Context> context, FitDesc desc)
        : context_(std::move(context)),
          given_(std::move(desc)),
          left_(std::make_unique<OnDevice>()) {}
    ~FitTask() override;

    // fit_task_open.cpp
    Result<run::Plan> prepare(const run::ReadText* config, run::Messages& messages) override;
    Status start(run::Messages& messages) override;
    Status recall(const JsonTree& run_json, const std::string& path) override;
    Status compare(const JsonTree& run_json, run::Messages& messages) override;
    Status load(const io::WeightsFile& state) override;
    Status begin() override { return {}; }

    // fit_task.cpp
    Status step(std::uint64_t most, std::deque<run::Step>& done) override;
    Status begin_validation(const std::vector<run::NamedWeights>& results) override;
    Status validate(std::uint32_t piece, run::Piece& done) override;
    [[nodiscard]] run::Validation validation() const override;
    Result<io::WeightsFile> state() override;
    Result<std::vector<run::NamedWeights>> results() override;
    Result<std::vector<run::NamedText>> texts() override;
    [[nodiscard]] run::Progress progress() const override { return {steps_, attempts_}; }
    [[nodiscard]] std::uint64_t peak_bytes() const override;
    [[nodiscard]] std::string headline(const std::string& folder) const override;
    void describe(JsonWriter& json) const override;

    /// The Gaussians as they are, in the photographs' frame.
    Result<scene::Gaussians> scene();

  private:
    /// What needs the context's mutex to be destroyed.
    struct OnDevice : vk::DeferredWork {
        std::unique_ptr<Fitter> fitter;
    };

    /// Call `body` with the device locked, and with the memory that the fit may take.
    template <class Body>
    auto on_device(Body&& body) -> decltype(body()) {
        return context_->mutex.call([&]() -> decltype(body()) {
            const vk::MemoryLimit limit(context_->memory(), limit_);
            return body();
        });
    }
    /// The same again with less, as long as memory runs out.
    Status sparing(const std::function<Status()>& body);
    /// Says of memory that ran out in a run what can be done.
    [[nodiscard]] Status explained(const Status& done) const;

    Status open_data(run::Messages& messages);
    Status choose_memory(std::vector<data::PosedPhoto>& fitted, Priors& priors, ScheduleDesc& desc,
                         run::Messages& messages);
    Status cut_memory(const FitCosts& costs, std::span<const data::PosedPhoto> sizes,
                      std::uint32_t wanted, std::uint64_t left, run::Messages& messages);
    Status reduce_photos(std::vector<data::PosedPhoto>& fitted, Priors& priors, ScheduleDesc& desc,
                         run::Messages& messages);
    Status choose_steps(run::Messages& messages);
    // fit_task_first.cpp
    /// Chooses points, or the scene, to begin with, and aligns maps; drops the maps of losses without a weight.
    Result<Priors> choose_first(std::vector<data::PosedPhoto>& fitted, run::Messages& messages);
    Status use_scene();
    Status use_depth(std::span<const data::PosedPhoto> fitted, const Priors& priors,
                     run::Messages& messages);
    [[nodiscard]] std::size_t first_count() const;
    [[nodiscard]] Status check_first() const;
    /// Begin; with copies of what there is, if that is fewer than `least`, which cover the same area.
    Status place_first(std::size_t least = 0);
    [[nodiscard]] std::uint32_t degree() const;
    [[nodiscard]] double fraction() const;

    std::shared_ptr<vk::Context> context_;
    FitDesc given_;
    FitOptions options_;
    std::vector<data::PosedPhoto> held_out_;
    io::ColoredPoints points_;
    std::optional<scene::Gaussians> first_;    ///< instead of points
    PhotoFrame frame_;                         ///< origin of the fit in the photographs' frame
    std::uint32_t data_sum_ = 0;               ///< CRC-32 of photographs, cameras and points
    std::size_t fitted_ = 0;                   ///< photographs
    FitMemory memory_;                         ///< estimate
    std::uint64_t limit_ = ~std::uint64_t{0};  ///< most bytes of the device in use
    std::string spared_;                       ///< what the next step tells
    std::unique_ptr<Fitter> fitter_;
    bool resumed_ = false;
    std::uint64_t steps_ = 0, attempts_ = 0;
    std::vector<run::Numbers> scores_;  ///< scores of the validation that goes on
    std::unique_ptr<OnDevice> left_;    ///< made beforehand, because a destructor must not fail
};

}  // namespace splat::fit
