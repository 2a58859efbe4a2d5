#pragma once

#include <memory>

#include "fit/first_gaussians.h"
#include "fit/fit_options.h"
#include "fit/fitter.h"
#include "run/task.h"

namespace splat::fit {

/// A fit of Gaussians to photographs, as the task of a run. Its result is "gaussians": the arrays of
/// scene::Gaussians by their names, in the photographs' frame.
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
    Result<run::Plan> prepare(const std::string* config, run::Messages& messages) override;
    Status start(run::Messages& messages) override;
    Status recall(const JsonTree& run_json, const std::string& path) override;
    Status compare(const JsonTree& run_json, run::Messages& messages) override;
    Status load(const io::WeightsFile& state) override;
    Status begin() override { return {}; }

    // fit_task.cpp
    Status step(run::Step& step) override;
    Status begin_validation(const std::vector<run::NamedWeights>& results) override;
    Status validate(std::uint32_t piece, run::Piece& done) override;
    [[nodiscard]] run::Validation validation() const override;
    Result<io::WeightsFile> state() override;
    Result<std::vector<run::NamedWeights>> results() override;
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
    struct ViewScores {
        double psnr = 0, ssim = 0;
    };

    template <class Body>
    auto on_device(Body&& body) -> decltype(body()) {
        const std::lock_guard lock(context_->mutex);
        SPLAT_TRY(context_->mutex.check());
        return body();
    }

    Status open_data(run::Messages& messages);
    Status choose_steps(run::Messages& messages);
    Status place_first();
    [[nodiscard]] std::uint32_t degree() const;
    [[nodiscard]] double fraction() const;

    std::shared_ptr<vk::Context> context_;
    FitDesc given_;
    FitOptions options_;
    std::vector<data::PosedPhoto> held_out_;
    io::ColoredPoints points_;
    scene::Vec3 center_{0};       ///< origin of the fit in the photographs' frame
    std::uint32_t data_sum_ = 0;  ///< CRC-32 of photographs, cameras and points
    std::size_t fitted_ = 0;      ///< photographs
    std::unique_ptr<Fitter> fitter_;
    std::uint64_t steps_ = 0, attempts_ = 0;
    std::vector<ViewScores> scores_;  ///< scores of the validation that goes on
    std::unique_ptr<OnDevice> left_;  ///< made beforehand, because a destructor must not fail
};

}  // namespace splat::fit
