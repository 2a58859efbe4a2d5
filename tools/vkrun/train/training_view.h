#pragma once

#include <splat.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vkrun/train/tensorboard.h"

namespace vkrun {

/// NaN where an event has no such number.
double number_of(const splat_run_event& event, std::string_view name);

/// Shows a training and adds to its folder: lines or a progress bar on standard error, tb/ for TensorBoard,
/// renders/ with input, truth, prediction and error of validation objects, and report.html, anew at every
/// validation and at the end.
class TrainingView {
  public:
    /// `folder` holds the run; `device` draws the scene of its page. Throws a Failure.
    TrainingView(std::string folder, std::string device);

    void show(const splat_run_event& event);
    /// The page of a training that has ended with an error.
    void show_failure() { write_page(false); }

  private:
    void show_step(const splat_run_event& event);
    [[nodiscard]] const char* line_start(std::uint64_t step) const;
    std::optional<double> seconds_left(const splat_run_event& event);
    void note_length(const splat_run_event& event, double left);
    void show_files() const;
    void keep_object(const splat_run_event& event);
    void show_validation(const splat_run_event& event);

    // These warn of what they cannot write.
    void save_sheet(std::uint64_t step);
    void save_scene();
    void write_page(bool running);

    std::string folder_, device_;
    TensorBoard board_;
    bool bar_;                                ///< standard error is a terminal
    std::uint64_t first_step_ = 0;            ///< the first step of this session
    double first_seconds_ = 0;                ///< time at its end: it also prepares the kernels
    bool length_known_ = false;               ///< enough steps were measured
    std::vector<std::vector<float>> images_;  ///< images of the objects that are shown
    std::vector<const float*> cells_;         ///< cells of the contact sheet, in `images_`
    std::uint32_t side_ = 0;
};

}  // namespace vkrun
