#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "vkrun/train/batches.h"
#include "vkrun/train/run_folder.h"
#include "vkrun/train/scores.h"
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

/// One run: steps, validations, states and weights in its folder.
class Training {
  public:
    /// Throws a Failure.
    explicit Training(const TrainingOptions& options);

    /// Until all steps are done, or `stop` says so after one.
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
    std::unique_ptr<DataSet> data_, validation_;
    Owner<splat_trainer, splat_trainer_destroy> trainer_;
    Model model_;
    std::unique_ptr<Network> network_;  ///< for validation; made when first needed
    std::unique_ptr<TensorBoard> board_;
    std::uint64_t iterations_ = 0;
    std::uint64_t step_ = 0, attempts_ = 0, saved_ = ~std::uint64_t{0};
    std::uint64_t skipped_ = 0, skipped_in_a_row_ = 0;
    double best_psnr_ = 0, last_psnr_ = 0, loss_ = 0;
    double averaged_loss_ = 0;  ///< of the latest steps, for the bar
    std::chrono::steady_clock::time_point begun_;
    std::uint64_t begun_at_ = 0;
    bool bar_ = false;
};

}  // namespace vkrun
