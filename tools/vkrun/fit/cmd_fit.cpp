// vkrun fit: Gaussians from posed photographs.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/fit/fit_report.h"
#include "vkrun/fit/geometry_maps.h"
#include "vkrun/fit/object.h"
#include "vkrun/fit/unposed.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/train/run_signals.h"

namespace vkrun {
namespace {

constexpr const char* kFitFooter =
    R"(DATA is a folder of photographs with their cameras: a COLMAP model (cameras, images and points3D, .bin or .txt,
in DATA, DATA/sparse/0 or DATA/sparse) and images/, or a transforms.json as instant-ngp and nerfstudio write it. The
distortion of the lens is undone. Every 8th photograph by name is held out for scores; a split of the data's own goes
before that.

Photographs without cameras get them by COLMAP, and a video also by ffmpeg, where these are installed: of a video the
sharpest frames are taken (docs/fit-photographs.md). --object leaves out what is not in masks, which a network makes
('vkrun priors where' lists some) unless --masks has them, and single Gaussians apart from the object.

Maps of --depth and --normals are named like the photographs (NAME.png, .npy or .pfm), of their stored size, and
needed for those that are fitted: 'vkrun priors depth photos/images --out photos' makes photos/depth. Depth is relative
and larger is nearer, or with --set depth_is_distance=true distances, 0 where not known. It is aligned with the points
in each view. --init depth begins with points on the depth maps as well. --geometry makes what lacks of both in
OUT-geometry, and begins with depth unless --init says otherwise.

OUT holds scene.ply, report.html, which is renewed at validations, loads itself again and turns the scene at the end,
config.json, run.json, log.txt, metrics.jsonl, events for TensorBoard (tb/), pictures of held-out photographs
(renders/), the last two states (checkpoints/) and the Gaussians as gaussians_last and gaussians_best.safetensors.
Ctrl-C, SIGTERM, a closed terminal and a closed pipe stop after the current step and save; --resume goes on with the
same bits. A run of --seconds says how many steps it chose: --steps repeats it with the same bits, with
--set memory_gaussians=N and memory_downscale=N of its config.json where memory cut it. 'vkrun eval
scene.ply --data DATA' scores a scene of any program on the same held-out photographs. --refine poses also writes
transforms.json: the cameras, those of fitted photographs corrected. Held-out photographs are drawn from the cameras
they have, without an exposure.

Exit status: 0 fitted, 1 failed, 2 wrong usage, or OUT is in use, 3 no device, 4 bad data, 5 out of memory, 7 ten steps
in a row were not finite, or 200 drew nothing, 130 interrupted.

Examples:
  vkrun fit photos --out run
  vkrun fit photos --out run --seconds 240 --downscale 2
  vkrun fit walk_around.mp4 --out run --object
  vkrun fit photos --out run --depth photos/depth --normals photos/normal --init depth
  vkrun fit photos --out run --geometry moge-2-vits-normal
  vkrun view run/scene.ply
)";

struct FitOptions : FitInput {
    std::string depth, normals, init, geometry;
    std::vector<std::string> refine, values, scenes;
    std::uint64_t steps = 0, seed = 0, memory = 0;
    double seconds = 0;
    std::uint32_t most_gaussians = 0, downscale = 0;
    std::optional<std::uint32_t> degree, test_every;
    bool white = false, json = false;
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
    check_opened(splat_fit_open(device, &desc, run.out()));
    return run;
}

/// Throws a usage Failure for a file that the scene cannot be written to.
void check_scene_files(const FitOptions& options) {
    for (const std::string& file : options.scenes) {
        if (named_format(file, true) == nullptr)
            throw Failure(kUsageError, "--scene is '" + file +
                                           "', expected a file of the extension " +
                                           scene_extensions(true));
        check_folder_of(file);
        check_target(file, options.overwrite || options.resume, {options.init});
    }
}

/// Save what the fit made. Throws a Failure.
void save_scene(const FitOptions& options, splat_scene scene) {
    check(splat_scene_save(scene, (options.out + "/scene.ply").c_str(), nullptr), kFailed);
    for (const std::string& file : options.scenes)
        check(splat_scene_save(scene, file.c_str(), nullptr), kFailed);
}

/// Makes the maps of --geometry. Those that are given by hand are not replaced.
void add_geometry(FitOptions& options) {
    if (options.geometry.empty() || options.resume) return;
    const GeometryMaps maps = make_geometry_maps(options.geometry, photos_of(options.data),
                                                 options.out, options.device, options.overwrite);
    if (options.depth.empty()) {
        options.depth = maps.depth;
        constexpr const char* kDistances = "depth_is_distance=";
        if (std::ranges::none_of(options.values, [](const std::string& value) {
                return value.starts_with(kDistances);
            }))
            options.values.push_back(kDistances + std::string("true"));
    }
    if (options.normals.empty()) options.normals = maps.normals;
    if (options.init.empty()) options.init = "depth";
}

int fit(FitOptions& options) {
    if (options.resume && options.overwrite)
        throw Failure(kUsageError, "--resume and --overwrite exclude each other");
    if (!options.resume && options.data.empty())
        throw Failure(kUsageError, "no data: name the folder of photographs");
    check_scene_files(options);
    const Device device = open_device(device_desc(options.device));
    prepare_input(options);
    add_geometry(options);
    catch_run_signals();
    const Run run = open_fit(device.get(), options);
    std::error_code none;
    if (!options.resume) {  // an earlier scene is not what this run makes
        std::filesystem::remove(splat::os::path_of(options.out + "/scene.ply"), none);
        note_begun(options);
    }
    FitView view(options.out);
    auto event = sized<splat_run_event>();
    while (event.kind < SPLAT_EVENT_DONE) {
        if (run_interrupted()) check(splat_run_interrupt(run.get()));
        const splat_result result = splat_run_next(run.get(), &event);
        try {
            check(result, result == SPLAT_ERROR_IO ? kFailed : kBadData);
        } catch (const Failure&) {
            view.finish();
            throw;
        }
        view.show(event);
        prepare_farewell(event);
    }
    Scene scene;
    check(splat_fit_scene(run.get(), scene.out()));
    std::exception_ptr failed;
    try {
        if (options.object && event.kind == SPLAT_EVENT_DONE) keep_object(scene.get(), options.out);
    } catch (...) {  // the scene is there all the same
        failed = std::current_exception();
    }
    save_scene(options, scene.get());
    view.finish();
    if (failed) std::rethrow_exception(failed);
    if (options.json) print_json(view.summary(run.get(), scene.get(), event));
    return event.kind == SPLAT_EVENT_DONE          ? kSuccess
           : event.kind == SPLAT_EVENT_INTERRUPTED ? kInterrupted
                                                   : kNotFinite;
}

}  // namespace

void add_fit(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "fit", "Fit a scene to photographs or a video.", kFitFooter);
    auto options = std::make_shared<FitOptions>();
    FitOptions& f = *options;
    command->add_option("DATA", f.data, "Folder of photographs, or a video")->type_name("");
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
        ->check(one_of({"auto", "colmap", "transforms"}));
    add_count_option(*command, "--frames", f.frames, "Frames to take of a video", 10, 10000);
    command->add_flag("--object", f.object,
                      "Keep the object alone: masks by a network, or --masks");
    command->add_option("--masks", f.masks, "Folder of masks, named like the photographs")
        ->type_name("DIR");
    command->add_option("--depth", f.depth, "Folder of depth maps, named like the photographs")
        ->type_name("DIR");
    command->add_option("--normals", f.normals, "Folder of normals, named like the photographs")
        ->type_name("DIR");
    command
        ->add_option(
            "--geometry", f.geometry,
            "Make both by a network in one pass, and begin with its points: a preset such\n"
            "as moge-2-vits-normal, or a file (weights of MoGe-2)")
        ->type_name("NAME");
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
        ->check(one_of({"poses", "exposure"}));
    add_changes_option(*command, f.values);
    command
        ->add_option("--scene", f.scenes,
                     "Another file for the scene, " + scene_extensions(true) + ";\nmay be repeated")
        ->type_name("FILE")
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false);
    command->add_flag("--white-background", f.white, "Transparent pictures lie on white");
    command->add_option("--seed", f.seed, "Seed; default: 0")->type_name("N");
    command->add_flag("--resume", f.resume, "Continue the run in --out");
    command->add_flag("--overwrite", f.overwrite, "Replace the run in --out");
    add_device_option(*command, f.device);
    command->add_flag("--json", f.json, "Print one JSON object on standard output at the end");
    command->callback([options, command, &exit_code] {
        options->frames_given = command->count("--frames") > 0;
        exit_code = fit(*options);
    });
}

}  // namespace vkrun
