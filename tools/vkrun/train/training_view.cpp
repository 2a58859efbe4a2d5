#include "vkrun/train/training_view.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "core/os/console.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/text.h"
#include "vkrun/train/run_report.h"
#include "vkrun/train/run_scene.h"

namespace vkrun {
namespace {

/// Objects of a validation that are shown, and views of each.
constexpr std::uint32_t kShownObjects = 4, kShownViews = 3;

unsigned long long wide(std::uint64_t number) {
    return number;
}

}  // namespace

double number_of(const splat_run_event& event, std::string_view name) {
    for (std::uint64_t i = 0; i < event.number_count; ++i)
        if (name == event.numbers[i].name) return event.numbers[i].value;
    return std::nan("");
}

TrainingView::TrainingView(std::string folder, std::string device)
    : folder_(std::move(folder)),
      device_(std::move(device)),
      board_(folder_ + "/tb"),
      bar_(splat::os::errors_on_terminal()) {}

void TrainingView::show(const splat_run_event& event) {
    if (event.kind == SPLAT_EVENT_STEP && event.updated != 0) show_step(event);
    if (event.kind == SPLAT_EVENT_VALIDATED_PIECE) keep_object(event);
    if (event.kind == SPLAT_EVENT_VALIDATION) show_validation(event);
    const bool ends = event.kind >= SPLAT_EVENT_DONE && event.text != nullptr;
    if (ends) write_page(false);
    if (event.text != nullptr)
        std::fprintf(stderr, "%s%s\n", line_start(event.step), in_own_words(event.text).c_str());
    if (ends) show_files();
}

const char* TrainingView::line_start(std::uint64_t step) const {
    return bar_ && step > 0 ? "\r\033[K" : "";
}

/// By the steps of this session without its first one, which prepares the kernels; none after that one.
std::optional<double> TrainingView::seconds_left(const splat_run_event& event) {
    if (first_step_ == 0) {
        first_step_ = event.step;
        first_seconds_ = event.seconds;
    }
    if (event.step == first_step_) return std::nullopt;
    const double each =
        (event.seconds - first_seconds_) / static_cast<double>(event.step - first_step_);
    return each * static_cast<double>(event.iterations - event.step);
}

/// Once, as soon as the first steps tell: what a long training may be made smaller by.
void TrainingView::note_length(const splat_run_event& event, double left) {
    constexpr double kLong = 3600, kMeasured = 10;  // seconds
    constexpr std::uint64_t kSteps = 20;
    const std::uint64_t steps = event.step - first_step_;
    const double seconds = event.seconds - first_seconds_;
    if (length_known_ || (steps < kSteps && seconds < kMeasured)) return;
    length_known_ = true;
    if (left <= kLong) return;
    std::fprintf(stderr,
                 "%snote: at %.3g s a step, as measured on %llu step%s, the other %llu take %s. "
                 "Smaller are: fewer steps (--set opt.iterations=N), fewer objects a step "
                 "(opt.batch_size), smaller pictures (data.training_resolution), a smaller network "
                 "(model.base_dim, model.num_blocks); 'vkrun train small' ends within minutes. "
                 "Ctrl-C saves what is done, and --resume continues it\n",
                 line_start(event.step), seconds / static_cast<double>(steps), wide(steps),
                 steps == 1 ? "" : "s", wide(event.iterations - event.step),
                 duration_text(left).c_str());
}

/// What a training that has ended leaves to look at and to use.
void TrainingView::show_files() const {
    const std::pair<const char*, const char*> files[] = {
        {"report", "report.html"},
        {"best weights", "weights_best.safetensors"},
        {"last weights", "weights_last.safetensors"}};
    for (const auto& [what, name] : files)
        if (const std::string path = folder_ + "/" + name;
            std::filesystem::exists(splat::os::path_of(path)))
            std::fprintf(stderr, "%s: %s\n", what, path.c_str());
}

void TrainingView::show_step(const splat_run_event& event) {
    const auto number = [&](const char* name) { return number_of(event, name); };
    const double psnr = number("psnr");
    if (event.logged != 0)
        board_.scalars(
            event.step,
            {{"train/loss", number("loss")}, {"train/psnr", psnr}, {"train/rate", number("rate")}});
    const std::string memory = bytes_text(event.peak_bytes);
    const std::optional<double> seconds = seconds_left(event);
    if (seconds) note_length(event, *seconds);
    const std::string left = seconds ? duration_text(*seconds) + " left" : "";
    const double exchanged = number("exchange_bytes");
    const std::string exchange =
        std::isnan(exchanged) ? ""
                              : format(", exchange %.0f of %s", number("exchange_ms"),
                                       bytes_text(static_cast<std::uint64_t>(exchanged)).c_str());
    if (!bar_) {
        if (event.logged == 0) return;
        const double network = number("network_ms"), render = number("render_ms"),
                     update = number("update_ms"), visible = number("visible");
        std::fprintf(
            stderr,
            "step %llu/%llu: loss %.6f, PSNR %.2f dB, rate %.3g, %.0f of %.0f visible, "
            "%.0f ms (network %.0f, render %.0f, update %.0f%s), device memory at most %s%s\n",
            wide(event.step), wide(event.iterations), number("loss"), psnr, number("rate"), visible,
            visible + number("culled"), network + render + update, network, render, update,
            exchange.c_str(), memory.c_str(), (left.empty() ? "" : ", " + left).c_str());
        return;
    }
    std::fprintf(stderr, "\rstep %llu/%llu  loss %.5f  PSNR %.2f  %.2f steps/s  %s  %s\033[K",
                 wide(event.step), wide(event.iterations), number("averaged_loss"), psnr,
                 event.steps_per_second, left.c_str(), memory.c_str());
    if (event.step == event.iterations) std::fputs("\n", stderr);
    std::fflush(stderr);
}

void TrainingView::keep_object(const splat_run_event& event) {
    if (event.piece == 0) {
        images_.clear();
        cells_.clear();
    }
    if (event.piece >= kShownObjects) return;
    side_ = event.width;
    const std::size_t plane = std::size_t{3} * side_ * side_;
    std::vector<float> truths(event.truths, event.truths + event.image_count);
    std::vector<float> images(event.images, event.images + event.image_count);
    std::vector<float> errors(images.size());  // white where there is none
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = 1 - std::abs(images[i] - truths[i]);
    cells_.push_back(truths.data());
    const std::size_t novel = event.views - event.inputs;
    for (std::size_t i = 0; i < kShownViews; ++i) {
        const std::size_t view = event.inputs + i * novel / kShownViews;
        for (const std::vector<float>* shown : {&truths, &images, &errors})
            cells_.push_back(shown->data() + view * plane);
    }
    for (std::vector<float>* shown : {&truths, &images, &errors})
        images_.push_back(std::move(*shown));  // the numbers stay where they are
}

void TrainingView::show_validation(const splat_run_event& event) {
    save_sheet(event.step);
    const double psnr = number_of(event, "val_psnr");
    board_.scalars(event.step,
                   {{"val/psnr_novel", psnr}, {"val/ssim_novel", number_of(event, "val_ssim")}});
    if (psnr >= number_of(event, "best_val_psnr")) save_scene();
    write_page(true);
}

void TrainingView::save_sheet(std::uint64_t step) {
    try {
        make_folder(folder_ + "/renders");
        contact_sheet(cells_, side_, 1 + 3 * kShownViews)
            .save(folder_ + format("/renders/step_%08llu.png", wide(step)));
    } catch (const Failure& failure) {  // no reason to end a training
        std::fprintf(stderr, "vkrun: warning: no pictures of a validation: %s\n", failure.what());
    }
}

void TrainingView::save_scene() {
    if (!std::filesystem::exists(splat::os::path_of(folder_ + "/weights_best.safetensors")))
        return;  // nothing is trained
    try {
        save_run_scene(folder_, device_);
    } catch (const Failure& failure) {  // such as too little memory beside the training
        std::fprintf(stderr, "vkrun: warning: no scene in report.html: %s\n", failure.what());
    }
}

void TrainingView::write_page(bool running) {
    try {
        write_run_report({folder_}, "", running);
    } catch (const Failure& failure) {
        std::fprintf(stderr, "vkrun: warning: no report.html: %s\n", failure.what());
    }
}

}  // namespace vkrun
