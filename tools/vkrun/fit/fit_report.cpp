#include "vkrun/fit/fit_report.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "core/os/console.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/train/run_report.h"
#include "vkrun/train/training_view.h"
#include "vkrun/view/scene_viewer.h"

namespace vkrun {
namespace {

/// Photographs of a validation that are shown.
constexpr std::uint32_t kShownPhotos = 4;

/// Share of a fit's time that pictures and pages may take.
constexpr double kReportShare = 0.01;

}  // namespace

FitView::FitView(std::string folder)
    : folder_(std::move(folder)), board_(folder_ + "/tb"), bar_(splat::os::errors_on_terminal()) {}

void FitView::show(const splat_run_event& event) {
    if (event.kind == SPLAT_EVENT_STEP && event.updated != 0) show_step(event);
    if (event.kind == SPLAT_EVENT_VALIDATED_PIECE) {
        if (event.piece == 0) sheet_ = {};
        const std::uint32_t each = (event.pieces + kShownPhotos - 1) / kShownPhotos;
        if (event.piece % each == 0)
            sheet_.add(event.truths, event.images, event.width, event.height);
    }
    if (event.kind == SPLAT_EVENT_VALIDATION) show_validation(event);
    if (event.text != nullptr)
        std::fprintf(stderr, "%s%s\n", bar_ && event.step > 0 ? "\r\033[K" : "",
                     in_own_words(event.text).c_str());
}

void FitView::show_step(const splat_run_event& event) {
    const auto number = [&](const char* name) { return number_of(event, name); };
    const double ms =
        number("raster_ms") + number("loss_ms") + number("update_ms") + number("grow_ms");
    const double fraction = number("fraction");
    // The first step of a session also prepares the kernels.
    if (first_fraction_ < 0)
        first_fraction_ = fraction;
    else
        measured_ += ms / 1000;
    seconds_ += ms / 1000;
    if (event.logged != 0)
        board_.scalars(event.step, {{"train/loss", number("loss")},
                                    {"train/psnr", number("psnr")},
                                    {"train/gaussians", number("gaussians")}});
    if (!bar_ && event.logged == 0) return;
    const double done = fraction - first_fraction_;
    show_bar(event, ms,
             done > 0 ? "  " + duration_text(measured_ * (1 - fraction) / done) + " left" : "");
}

void FitView::show_bar(const splat_run_event& event, double ms, const std::string& left) {
    const auto number = [&](const char* name) { return number_of(event, name); };
    const std::string held_out = std::isnan(psnr_) ? "" : format(" (held out %.2f)", psnr_);
    const std::string shares =
        bar_ ? ""
             : format("  %.1f ms (raster %.1f, loss %.1f, update %.1f)", ms, number("raster_ms"),
                      number("loss_ms"), number("update_ms"));
    std::fprintf(stderr,
                 "%sstep %llu/%llu  loss %.4f  PSNR %.2f%s  %.0f Gaussians%s  %.1f steps/s%s%s",
                 bar_ ? "\r" : "", static_cast<unsigned long long>(event.step),
                 static_cast<unsigned long long>(event.iterations), number("averaged_loss"),
                 number("psnr"), held_out.c_str(), number("gaussians"), shares.c_str(),
                 event.steps_per_second, left.c_str(), bar_ ? "\033[K" : "\n");
    std::fflush(stderr);
}

void FitView::show_validation(const splat_run_event& event) {
    psnr_ = number_of(event, "val_psnr");
    board_.scalars(event.step,
                   {{"val/psnr_novel", psnr_}, {"val/ssim_novel", number_of(event, "val_ssim")}});
    validated_ = event.step;
    sheet_saved_ = false;
    if (spent_ <= kReportShare * watch_.seconds()) write_page(true);
}

void FitView::finish() {
    write_page(false);
    const std::pair<const char*, const char*> files[] = {{"report", "report.html"},
                                                         {"scene", "scene.ply"}};
    for (const auto& [what, name] : files)
        if (const std::string path = folder_ + "/" + name;
            std::filesystem::exists(splat::os::path_of(path)))
            std::fprintf(stderr, "%s: %s\n", what, path.c_str());
}

void FitView::write_page(bool running) {
    const Stopwatch writing;
    try {
        if (!sheet_saved_) {
            make_folder(folder_ + "/renders");
            sheet_.save(folder_ + format("/renders/step_%08llu.png", validated_));
        }
        sheet_saved_ = true;
        write_run_report({folder_}, "", running);
    } catch (const Failure& failure) {  // no reason to end a fit
        std::fprintf(stderr, "vkrun: warning: no report.html: %s\n", failure.what());
    }
    spent_ += writing.seconds();
}

Json FitView::summary(splat_run run, splat_scene scene, const splat_run_event& last) const {
    const Json report = library_json(splat_run_report, run);
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene, &info));
    Json json;
    json["held_out_psnr"] = report.at("val_psnr");
    json["held_out_ssim"] = report.at("val_ssim");
    json["gaussians"] = info.count;
    json["steps"] = last.step;
    json["seconds"] = seconds_;
    json["peak_memory"] = last.peak_bytes;
    return json;
}

void check_opened(splat_result opened) {
    const bool bad_data = opened == SPLAT_ERROR_NOT_FOUND || opened == SPLAT_ERROR_FORMAT ||
                          opened == SPLAT_ERROR_SHAPE_MISMATCH || opened == SPLAT_ERROR_UNSUPPORTED;
    check(opened, bad_data ? kBadData : opened == SPLAT_ERROR_IO ? kFailed : kUsageError);
}

void add_fitted_scene(HtmlPage& page, const std::string& folder, const Json& config) {
    const std::string path = folder + "/scene.ply";
    std::error_code none;
    if (!std::filesystem::exists(splat::os::path_of(path), none)) return;
    const SceneFile file = load_scene(path);
    add_scene_of_photographs(page, file.scene.get(), config.value("data", ""),
                             config.value("cameras", "") == "transforms",
                             config.value("white_background", false));
}

void add_scene_of_photographs(HtmlPage& page, splat_scene scene, const std::string& data,
                              bool transforms, bool white) {
    ViewerOptions viewer;
    viewer.name = "the scene";
    viewer.instead = "Pictures of it are on this page.";
    try {
        viewer.cameras = load_cameras(cameras_in(data, transforms),
                                      {.size = {}, .ignore_distortion = true, .without_size = true})
                             .cameras;
    } catch (const Failure&) {  // the photographs were moved
    }
    if (viewer.cameras.empty()) {
        constexpr double kElevation = 11;
        viewer.cameras = orbit_cameras(scene, {}, kElevation, 0, 3);
    }
    if (white)
        for (float& value : viewer.background) value = 1;
    up_of(viewer.cameras, viewer.up);
    viewer.turning = true;
    add_viewer(page, scene, viewer);
}

}  // namespace vkrun
