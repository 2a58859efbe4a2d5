// vkrun bench raster: how fast the rasterizer draws a scene, how right, and what each skip gains.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>

#include "vkrun/command.h"
#include "vkrun/device_text.h"
#include "vkrun/raster_bench.h"
#include "vkrun/scene_input.h"
#include "vkrun/table.h"

namespace vkrun {
namespace {

constexpr const char* kBenchRasterFooter =
    R"(Each view is drawn by plain and by fast kernels in turn (A B A B) in this one process,
forward and backward: at least three timed rounds, or one if they take long.

  render             forward without a backward pass to come; the row "forward" keeps what that needs
  min ms, median ms  wall time of a call, over all views and rounds
  project ... blend  device time of the stages, shortest of each view's, mean over the views
  ns/pair            blending, per pixel of a tile and entry of the tile's list
  typical, max error of the RGB at sampled pixels against float64 (95 % are below the typical
                     one; a pixel within rounding of a threshold may be off by 1/255); in the
                     backward rows of the gradients, relative to the largest of their tensor
                     (of all, where a tensor is zero but for rounding)
  without            the fast kernels without one kind of skipping, in turns with all of them;
                     max difference of the two images (or gradients, relative), max error and
                     with error against float64. "unchanged": a call that repeats the one
                     before. "bands above D": the scene's spherical harmonics all or only to
                     degree D, which is another image

Without SCENE: 100,000 random Gaussians at 640 x 360.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device, 4 a file cannot be read.

Examples:
  vkrun bench raster scene.ply --cameras transforms.json
  vkrun bench raster scene.spz --orbit 4 --size 1280x720 --json > raster.json
)";

struct BenchRasterOptions {
    std::string scene;
    std::string cameras;
    std::uint32_t orbit = 0;
    std::optional<double> distance;  ///< scene units
    std::optional<double> scale;
    std::string size;
    bool ignore_distortion = false;
    std::string convention = "3dgs";
    std::vector<float> background = {0, 0, 0};
    std::string device = "best";
    double seconds = 8;
    int samples = 200;
    bool json = false;
    bool no_plain = false;
    bool exact_pairs = false;
    std::string csv;
    std::string svg;
};

/// As ../bench of the field: centres uniform in the frustum, sizes of 1.5 pixels and log-normal.
Scene random_scene(std::uint64_t count, double focal, double width, double height) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> depth(2, 10);
    std::uniform_real_distribution<double> side(-1.05, 1.05);
    std::normal_distribution<double> normal;
    std::vector<float> means, log_scales, rotations, logits, sh;
    const auto push = [](std::vector<float>& to, double x) { to.push_back(static_cast<float>(x)); };
    for (std::uint64_t i = 0; i < count; ++i) {
        const double z = depth(random);
        push(means, side(random) * width / 2 * z / focal);
        push(means, side(random) * height / 2 * z / focal);
        push(means, z);
        const double base = std::log(z / focal * 1.5) + 0.5 * normal(random);
        for (int k = 0; k < 3; ++k) push(log_scales, base + 0.5 * normal(random));
        double q[4];
        double squared = 0;
        for (double& x : q) {
            x = normal(random);
            squared += x * x;
        }
        for (const double x : q) push(rotations, x / std::sqrt(squared));
        push(logits, 1.5 * normal(random));
        for (int k = 0; k < 3; ++k) push(sh, 0.8 * normal(random));
    }
    auto desc = sized<splat_scene_desc>();
    desc.count = count;
    desc.means = means.data();
    desc.log_scales = log_scales.data();
    desc.rotations = rotations.data();
    desc.opacity_logits = logits.data();
    desc.sh = sh.data();
    Scene scene;
    check(splat_scene_create(&desc, scene.out()));
    return scene;
}

ImageSize size_of(const BenchRasterOptions& options) {
    return options.size.empty() ? ImageSize{640, 360} : image_size(options.size);
}

std::vector<splat_camera> cameras_for(const BenchRasterOptions& options, splat_scene scene) {
    std::vector<splat_camera> cameras;
    if (!options.cameras.empty()) {
        const CameraFile file =
            load_cameras(options.cameras, {image_size(options.size), options.ignore_distortion});
        for (const std::string& warning : file.warnings)
            std::fprintf(stderr, "vkrun: warning: %s\n", warning.c_str());
        cameras = file.cameras;
        if (cameras.empty()) throw Failure(kBadData, "'" + options.cameras + "' has no cameras");
    } else {
        const ImageSize size = size_of(options);
        auto desc = sized<splat_orbit_desc>();
        desc.width = size.width;
        desc.height = size.height;
        desc.distance = options.distance.value_or(0);
        cameras.resize(options.orbit > 0 ? options.orbit : 4);
        check(splat_camera_orbit(scene, &desc, static_cast<std::uint32_t>(cameras.size()),
                                 cameras.data()));
    }
    const double scale = options.scale.value_or(1);
    for (splat_camera& camera : cameras) {
        camera.width = static_cast<std::uint32_t>(std::lround(camera.width * scale));
        camera.height = static_cast<std::uint32_t>(std::lround(camera.height * scale));
        for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value *= scale;
        if (camera.width != cameras[0].width || camera.height != cameras[0].height)
            throw Failure(kBadData, options.cameras + ": cameras of different sizes; expected one");
    }
    return cameras;
}

RasterCase make_case(const BenchRasterOptions& options) {
    RasterCase made;
    if (options.scene.empty()) {
        const auto [width, height] = size_of(options);
        const double focal = 0.78 * width;
        made.title = "random100k";
        made.scene = random_scene(100000, focal, width, height);
        made.cameras = {{width,
                         height,
                         focal,
                         focal,
                         width / 2.0,
                         height / 2.0,
                         {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}};
    } else {
        made.title = options.scene.substr(options.scene.find_last_of('/') + 1);
        check(splat_scene_load(options.scene.c_str(), nullptr, made.scene.out()), kBadData);
        auto info = sized<splat_scene_info>();
        check(splat_scene_get_info(made.scene.get(), &info));
        if (info.count == 0)
            throw Failure(kBadData, "'" + options.scene + "' holds no Gaussians to be timed");
        made.cameras = cameras_for(options, made.scene.get());
    }
    made.convention =
        options.convention == "gsplat" ? SPLAT_CONVENTION_GSPLAT : SPLAT_CONVENTION_3DGS;
    std::copy_n(options.background.begin(), 3, made.background);
    return made;
}

/// Refuses what would not count.
void check_options(const BenchRasterOptions& options) {
    const std::pair<const char*, bool> of_a_scene[] = {{"--cameras", !options.cameras.empty()},
                                                       {"--orbit", options.orbit > 0},
                                                       {"--distance", options.distance.has_value()},
                                                       {"--scale", options.scale.has_value()}};
    for (const auto& [name, is_given] : of_a_scene)
        if (is_given && options.scene.empty())
            throw Failure(kUsageError, std::string(name) +
                                           " needs SCENE: the random one has a camera of its own, "
                                           "whose size is --size");
    if (!options.cameras.empty() && (options.orbit > 0 || options.distance))
        throw Failure(kUsageError, std::string(options.orbit > 0 ? "--orbit" : "--distance") +
                                       " places cameras around the scene; those of --cameras have "
                                       "their places");
    if (options.ignore_distortion && options.cameras.empty())
        throw Failure(kUsageError, "--ignore-distortion is for --cameras");
    if (options.distance) check_number("--distance", *options.distance, 1e-6, 1e9);
    if (options.scale) check_number("--scale", *options.scale, 0.01, 16);
    check_background(options.background);
}

int run_bench_raster(const BenchRasterOptions& options) {
    check_options(options);
    const auto open = [&](splat_kernels kernels, bool profile) {
        splat_device_desc desc = device_desc(options.device);
        desc.kernels = kernels;
        desc.flags = profile ? SPLAT_DEVICE_PROFILE : 0;
        return open_device(desc);
    };
    const RasterDevices devices{open(SPLAT_KERNELS_PLAIN, false), open(SPLAT_KERNELS_AUTO, false),
                                open(SPLAT_KERNELS_PLAIN, true), open(SPLAT_KERNELS_AUTO, true)};
    const RasterCase from = make_case(options);
    const RasterMeasurement measurement = measure_raster(
        devices, from, {options.seconds, !options.no_plain, options.samples, options.exact_pairs});
    const splat_device_info info = info_of(devices.fast.get());
    if (options.json) {
        Json document;
        document["library"] = splat_version_string();
        document["device"] = device_json(info);
        document["convention"] = options.convention;
        document["result"] = raster_json(measurement);
        std::printf("%s\n", json_text(document).c_str());
    } else {
        std::printf("device %u: %s (%s, %s); libsplat %s; convention %s\n%s", info.index, info.name,
                    kind_name(info.kind), info.driver, splat_version_string(),
                    options.convention.c_str(), raster_table(measurement).c_str());
    }
    write_text(options.csv, raster_csv(measurement));
    write_text(options.svg, raster_svg(measurement));
    return kSuccess;
}

}  // namespace

void add_bench_raster(CLI::App& bench, int& exit_code) {
    CLI::App* raster = bench.add_subcommand(
        "raster",
        "Time the rasterizer on a scene, compare it with float64, and measure each skip.");
    raster->group("Commands");
    const auto options = std::make_shared<BenchRasterOptions>();
    raster->add_option("SCENE", options->scene, scene_extensions())->check(CLI::ExistingFile);
    raster->add_option("--cameras", options->cameras, "transforms.json, or a COLMAP folder")
        ->check(CLI::ExistingPath);
    raster->add_flag("--ignore-distortion", options->ignore_distortion,
                     "Take cameras with a distorting lens as pinholes");
    raster->add_option("--orbit", options->orbit, "Views around the scene; 4 without --cameras")
        ->check(CLI::Range(1, 10000).description(""));
    raster->add_option("--distance", options->distance,
                       "Their distance from its centre; else it fills the image");
    raster
        ->add_option("--size", options->size,
                     "Pixels of those views, of the random scene (640x360),\n"
                     "or of a camera file that says none")
        ->type_name("WxH");
    raster->add_option("--scale", options->scale, "Multiply the size of the images");
    raster->add_option("--convention", options->convention, "3dgs or gsplat")
        ->check(CLI::IsMember({"3dgs", "gsplat"}));
    raster->add_option("--background", options->background, "RGB")->delimiter(',')->expected(3);
    raster->add_option("--device", options->device, "As 'vkrun devices' names them");
    raster->add_option("--seconds", options->seconds, "Time for each comparison")
        ->check(CLI::Range(0.0, 3600.0).description(""));
    raster->add_option("--samples", options->samples, "Pixels compared with float64")
        ->check(CLI::Range(1, 100000).description(""));
    raster->add_flag("--no-plain", options->no_plain, "Fast kernels only");
    raster->add_flag("--exact-pairs", options->exact_pairs,
                     "Count the pairs of tile and Gaussian that are needed, of all views");
    raster->add_flag("--json", options->json, "JSON on standard output");
    raster->add_option("--csv", options->csv, "Also write all figures as a CSV file")
        ->type_name("FILE");
    raster->add_option("--svg", options->svg, "Also draw the stages' times and the skips' gains")
        ->type_name("FILE");
    raster->footer(kBenchRasterFooter);
    raster->callback([options, &exit_code] { exit_code = run_bench_raster(*options); });
}

}  // namespace vkrun
