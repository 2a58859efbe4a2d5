#pragma once

#include <functional>
#include <memory>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/data/view_source.h"
#include "vkrun/eval/scores.h"
#include "vkrun/train/batches.h"
#include "vkrun/train/run_folder.h"
#include "vkrun/train/tensorboard.h"

namespace vkrun {

struct TrainingOptions {
    std::string config, data, out, init;
    std::vector<std::string> changes, init_channels;
    bool resume = false;
    bool overwrite = false;
    std::string device = "best";
};

enum class TrainingEnd { kDone, kInterrupted, kNotFinite };

/// One run of a trainer: steps, validations, states and weights in its folder.
class TrainingRun {
  public:
    /// Throws a Failure.
    explicit TrainingRun(const TrainingOptions& options);

    /// Runs until all steps are done or `stop` returns true after one.
    TrainingEnd run(const std::function<bool()>& stop);

    [[nodiscard]] Json summary() const;

  private:
    void open_data();
    void start(const TrainingOptions& options);
    void resume();
    void write_run(const std::string& state) const;
    void after_step(const splat_trainer_info& info);
    void say(const splat_trainer_info& info);
    [[nodiscard]] splat_memory_info memory() const;
    void show_progress(const splat_trainer_info& info);
    void save_state();
    void validate(std::uint64_t step);
    [[nodiscard]] std::uint64_t setting(const char* name) const;

    Json config_;
    std::unique_ptr<RunFolder> folder_;
    Device device_;
    std::unique_ptr<ViewSource> data_, validation_;
    Trainer trainer_;
    Model model_;
    std::unique_ptr<Network> network_;  ///< for validation; made when first needed
    std::unique_ptr<TensorBoard> board_;
    std::uint64_t iterations_ = 0;
    std::uint64_t step_ = 0, attempts_ = 0, saved_ = ~std::uint64_t{0};
    std::uint64_t skipped_ = 0, skipped_in_a_row_ = 0;
    double best_psnr_ = 0, last_psnr_ = 0, loss_ = 0;
    double averaged_loss_ = 0;  ///< over the latest steps, for the progress line
    Stopwatch watch_;           ///< of this process's steps
    std::uint64_t begun_at_ = 0;
    bool bar_ = false;
};

}  // namespace vkrun
