// vkrun fit: Gaussians from posed photographs.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/train/run_signals.h"
#include "vkrun/train/training_view.h"

namespace vkrun {
namespace {

constexpr const char* kFitFooter =
    R"(DATA is a folder of photographs with their cameras: a COLMAP model (cameras, images and points3D, .bin or .txt,
in DATA, DATA/sparse/0 or DATA/sparse) and images/, or a transforms.json as instant-ngp and nerfstudio write it. The
distortion of the lens is undone. Every 8th photograph by name is held out for scores; a split of the data's own goes
before that.

OUT holds scene.ply, config.json, run.json, log.txt, metrics.jsonl, the last two states (checkpoints/) and the
Gaussians as gaussians_last and gaussians_best.safetensors. Ctrl-C, SIGTERM, a closed terminal and a closed pipe stop
after the current step and save; --resume goes on with the same bits. A run of --seconds says how many steps it chose:
--steps repeats it with the same bits.

Exit status: 0 fitted, 1 failed, 2 wrong usage, or OUT is in use, 3 no device, 4 bad data, 5 out of memory, 7 ten steps
in a row were not finite, or 200 drew nothing, 130 interrupted.

Examples:
  vkrun fit photos --out run
  vkrun fit photos --out run --seconds 240 --downscale 2
  vkrun view run/scene.ply
)";

struct FitOptions {
    std::string data, out, masks, cameras, depth, normals, init;
    std::vector<std::string> refine, values;
    std::uint64_t steps = 0, seed = 0, memory = 0;
    double seconds = 0;
    std::uint32_t most_gaussians = 0, downscale = 0;
    std::optional<std::uint32_t> degree, test_every;
    bool white = false, resume = false, overwrite = false, json = false;
    std::string device = "best";
};

Run open_fit(splat_device device, const FitOptions& options) {
    auto desc = sized<splat_fit_desc>();
    if (options.resume) desc.flags |= SPLAT_FIT_RESUME;
    if (options.overwrite) desc.flags |= SPLAT_FIT_OVERWRITE;
    if (options.white) desc.flags |= SPLAT_FIT_WHITE_BACKGROUND;
    if (options.test_every == 0) desc.flags |= SPLAT_FIT_ALL_PHOTOS;
    desc.folder = options.out.c_str();
    if (!options.data.empty()) desc.data = options.data.c_str();
    if (!options.masks.empty()) desc.masks = options.masks.c_str();
    desc.steps = options.steps;
    desc.seconds = options.seconds;
    desc.seed = options.seed;
    desc.max_gaussians = options.most_gaussians;
    if (options.degree) desc.sh_bands = *options.degree + 1;
    desc.downscale = options.downscale;
    desc.test_every = options.test_every.value_or(0);
    desc.cameras = options.cameras == "colmap"       ? SPLAT_FIT_CAMERAS_COLMAP
                   : options.cameras == "transforms" ? SPLAT_FIT_CAMERAS_TRANSFORMS
                                                     : SPLAT_FIT_CAMERAS_AUTO;
    if (!options.depth.empty()) desc.depth = options.depth.c_str();
    if (!options.normals.empty()) desc.normals = options.normals.c_str();
    if (!options.init.empty()) desc.init = options.init.c_str();
    desc.memory_bytes = options.memory;
    for (const std::string& what : options.refine)
        desc.flags |= what == "poses" ? SPLAT_FIT_REFINE_POSES : SPLAT_FIT_REFINE_EXPOSURE;
    std::vector<const char*> values;
    for (const std::string& value : options.values) values.push_back(value.c_str());
    desc.values = values.data();
    desc.value_count = values.size();
    Run run;
    const splat_result opened = splat_fit_open(device, &desc, run.out());
    const bool bad_data = opened == SPLAT_ERROR_NOT_FOUND || opened == SPLAT_ERROR_FORMAT ||
                          opened == SPLAT_ERROR_SHAPE_MISMATCH || opened == SPLAT_ERROR_UNSUPPORTED;
    check(opened, bad_data ? kBadData : opened == SPLAT_ERROR_IO ? kFailed : kUsageError);
    return run;
}

/// Shows a fit by lines or a bar on standard error, and sums up what it did.
class FitView {
  public:
    void show(const splat_run_event& event) {
        if (event.kind == SPLAT_EVENT_STEP && event.updated != 0) show_step(event);
        if (event.kind == SPLAT_EVENT_VALIDATION) ssim_ = number_of(event, "val_ssim");
        if (event.text != nullptr)
            std::fprintf(stderr, "%s%s\n", bar_ && event.step > 0 ? "\r\033[K" : "",
                         in_own_words(event.text).c_str());
    }
    /// What a finished fit says of itself.
    [[nodiscard]] Json summary(splat_run run, splat_scene scene,
                               const splat_run_event& last) const {
        const Json report = library_json(splat_run_report, run);
        auto info = sized<splat_scene_info>();
        check(splat_scene_get_info(scene, &info));
        Json json;
        json["held_out_psnr"] = report.at("val_psnr");
        json["held_out_ssim"] = std::isfinite(ssim_) ? Json(ssim_) : Json();
        json["gaussians"] = info.count;
        json["steps"] = last.step;
        json["seconds"] = seconds_;
        json["peak_memory"] = last.peak_bytes;
        return json;
    }

  private:
    void show_step(const splat_run_event& event) {
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
        if (!bar_ && event.logged == 0) return;
        const double done = fraction - first_fraction_;
        const std::string left =
            done > 0 ? "  " + duration_text(measured_ * (1 - fraction) / done) + " left" : "";
        std::fprintf(
            stderr,
            "%sstep %llu/%llu  loss %.4f  PSNR %.2f  %.0f Gaussians  %.1f ms (raster %.1f, "
            "loss %.1f, update %.1f)%s%s",
            bar_ ? "\r" : "", static_cast<unsigned long long>(event.step),
            static_cast<unsigned long long>(event.iterations), number("averaged_loss"),
            number("psnr"), number("gaussians"), ms, number("raster_ms"), number("loss_ms"),
            number("update_ms"), left.c_str(), bar_ ? "\033[K" : "\n");
        std::fflush(stderr);
    }

    bool bar_ = isatty(STDERR_FILENO) != 0;
    double ssim_ = std::nan("");
    double seconds_ = 0;          ///< time of this session's steps
    double measured_ = 0;         ///< the same without the first one
    double first_fraction_ = -1;  ///< share of the fit that was done before
};

int fit(FitOptions& options) {
    if (options.resume && options.overwrite)
        throw Failure(kUsageError, "--resume and --overwrite exclude each other");
    if (!options.resume && options.data.empty())
        throw Failure(kUsageError, "no data: name the folder of photographs");
    catch_run_signals();
    const Device device = open_device(device_desc(options.device));
    const Run run = open_fit(device.get(), options);
    const std::string scene_file = options.out + "/scene.ply";
    std::error_code none;
    std::filesystem::remove(scene_file, none);  // an earlier one is not what this run makes
    FitView view;
    auto event = sized<splat_run_event>();
    while (event.kind < SPLAT_EVENT_DONE) {
        if (run_interrupted()) check(splat_run_interrupt(run.get()));
        const splat_result result = splat_run_next(run.get(), &event);
        check(result, result == SPLAT_ERROR_IO ? kFailed : kBadData);
        view.show(event);
        prepare_farewell(event);
    }
    Scene scene;
    check(splat_fit_scene(run.get(), scene.out()));
    check(splat_scene_save(scene.get(), scene_file.c_str(), nullptr), kFailed);
    if (options.json) print_json(view.summary(run.get(), scene.get(), event));
    return event.kind == SPLAT_EVENT_DONE          ? kSuccess
           : event.kind == SPLAT_EVENT_INTERRUPTED ? kInterrupted
                                                   : kNotFinite;
}

}  // namespace

void add_fit(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "fit", "Fit a scene to posed photographs.", kFitFooter);
    auto options = std::make_shared<FitOptions>();
    FitOptions& f = *options;
    command->add_option("DATA", f.data, "Folder of photographs and cameras")->type_name("");
    command->add_option("--out", f.out, "Folder of the run")->type_name("DIR")->required();
    CLI::Option* seconds =
        command
            ->add_option("--seconds", f.seconds,
                         "About how long to optimise on this device; default: 60")
            ->type_name("S");
    command->add_option("--steps", f.steps, "Steps instead, which repeat a run everywhere")
        ->type_name("N")
        ->excludes(seconds);
    command
        ->add_option("--max-gaussians", f.most_gaussians,
                     "Most Gaussians; default: by the length of the fit")
        ->type_name("N");
    command->add_option("--sh-degree", f.degree, "Degree of the spherical harmonics; default: 3")
        ->type_name("D")
        ->check(CLI::Range(0, 3));
    command
        ->add_option("--downscale", f.downscale, "Divide the photographs' sides by it; default: 1")
        ->type_name("D");
    command
        ->add_option("--test-every", f.test_every,
                     "Hold out every so many photographs; 0: none; default: 8")
        ->type_name("N");
    command->add_option("--cameras", f.cameras, "Cameras to read: auto, colmap or transforms")
        ->type_name("NAME")
        ->check(CLI::IsMember({"auto", "colmap", "transforms"}));
    command->add_option("--masks", f.masks, "Folder of masks, named like the photographs")
        ->type_name("DIR");
    command->add_option("--depth", f.depth, "Folder of depth maps, named like the photographs")
        ->type_name("DIR");
    command->add_option("--normals", f.normals, "Folder of normals, named like the photographs")
        ->type_name("DIR");
    command
        ->add_option("--init", f.init,
                     "Begin with points, depth, random ones, or a scene's file; default: points")
        ->type_name("NAME");
    command->add_option("--memory", f.memory, "Most device memory, such as 3G or 800M")
        ->type_name("SIZE")
        ->transform(CLI::AsSizeValue(false));
    command->add_option("--refine", f.refine, "Correct poses, exposure or both, by a comma")
        ->type_name("NAMES")
        ->delimiter(',')
        ->check(CLI::IsMember({"poses", "exposure"}));
    add_changes_option(*command, f.values);
    command->add_flag("--white-background", f.white, "Transparent pictures lie on white");
    command->add_option("--seed", f.seed, "Seed; default: 0")->type_name("N");
    command->add_flag("--resume", f.resume, "Continue the run in --out");
    command->add_flag("--overwrite", f.overwrite, "Replace the run in --out");
    add_device_option(*command, f.device);
    command->add_flag("--json", f.json, "Print one JSON object on standard output at the end");
    command->callback([options, &exit_code] { exit_code = fit(*options); });
}

}  // namespace vkrun
