// vkrun bench raster: the speed and the errors of the rasterizer on a scene, and the gain of each
// skip.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "bench/raster/raster_bench.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/scene/scene_file.h"

namespace vkrun {
namespace {

constexpr const char* kBenchRasterFooter =
    R"(Plain and fast kernels draw each view alternately (A B A B) in this one process, forward and
backward, in at least three timed rounds, or one if rounds take long.

  render             a forward pass alone; the row "forward" keeps what a backward pass needs
  min ms, median ms  wall time of a call, over all views and rounds
  project ... blend  device time of the stages: the shortest of each view, mean over the views
  ns/pair            blending, per pixel of a tile and entry of the tile's list
  typical, max error of the RGB at sampled pixels against float64 (95 % are below the typical
                     one; a pixel within rounding of a threshold may be off by 1/255); in
                     backward rows the error of the gradients, relative to the largest of
                     their tensor (of all tensors, if theirs is zero up to rounding)
  without            the fast kernels without one kind of skip, alternating with all skips:
                     max difference of the two images (or gradients, relative), max error and
                     with error against float64. "unchanged": a call that repeats the
                     previous one. "bands above D": spherical harmonics of all degrees against
                     those up to D, which make another image

A scene is drawn as its file says (see 'vkrun render').

Without SCENE: 100,000 random Gaussians at 640 x 360.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device, 4 a file cannot be read.

Examples:
  vkrun bench raster scene.ply --cameras transforms.json
  vkrun bench raster scene.spz --orbit 4 --size 1280x720 --json > raster.json
)";

struct BenchRasterOptions : bench::RasterCaseOptions {
    std::string device = "best";
    double seconds = 8;
    int samples = 200;
    bool json = false;
    bool no_plain = false;
    bool exact_pairs = false;
    bool no_skips = false;
    std::string csv;
    std::string svg;
};

int run_bench_raster(const BenchRasterOptions& options) {
    bench::check_options(options);
    check_number("--seconds", options.seconds, 0, 3600);
    for (const std::string& path : {options.csv, options.svg}) {
        check_target(path, true, {options.scene, options.cameras});
        check_folder_of(path);
    }
    const auto open = [&](splat_kernels kernels, bool profile) {
        splat_device_desc desc = device_desc(options.device);
        desc.kernels = kernels;
        desc.flags = profile ? SPLAT_DEVICE_PROFILE : 0;
        return open_device(desc);
    };
    const bench::RasterDevices devices{
        open(SPLAT_KERNELS_PLAIN, false), open(SPLAT_KERNELS_AUTO, false),
        open(SPLAT_KERNELS_PLAIN, true), open(SPLAT_KERNELS_AUTO, true)};
    const bench::RasterCase from = bench::make_case(options);
    const bench::RasterMeasurement measurement =
        bench::measure_raster(devices, from,
                              {options.seconds, !options.no_plain, options.samples,
                               options.exact_pairs, !options.no_skips});
    const splat_device_info info = info_of(devices.fast.get());
    if (options.json) {
        Json document;
        document["library"] = splat_version_string();
        document["device"] = device_json(info);
        document["convention"] = options.convention;
        document["result"] = bench::raster_json(measurement);
        print_json(document);
    } else {
        std::printf("%s; convention %s\n%s", device_sentence(info).c_str(),
                    options.convention.c_str(), bench::raster_table(measurement).c_str());
    }
    write_text(options.csv, bench::raster_csv(measurement));
    write_text(options.svg, bench::raster_svg(measurement));
    return kSuccess;
}

}  // namespace

void add_bench_raster(CLI::App& bench, int& exit_code) {
    CLI::App* raster = add_command(
        bench, "raster",
        "Time the rasterizer on a scene, compare it with float64, and measure each skip.",
        kBenchRasterFooter);
    const auto options = std::make_shared<BenchRasterOptions>();
    raster
        ->add_option("SCENE", options->scene,
                     "Scene: " + scene_extensions() + "; default: random Gaussians")
        ->type_name("")
        ->check(CLI::ExistingFile.description(""));
    raster
        ->add_option("--cameras", options->cameras,
                     "transforms.json, or the folder of a COLMAP model")
        ->type_name("FILE")
        ->check(CLI::ExistingPath.description(""));
    raster->add_flag("--ignore-distortion", options->ignore_distortion,
                     "Ignore the distortion of lenses");
    raster
        ->add_option("--orbit", options->orbit,
                     "N cameras on a circle around the scene; default: 4 if there\n"
                     "are no --cameras")
        ->type_name("N")
        ->check(CLI::Range(1, 10000).description(""));
    raster
        ->add_option("--distance", options->distance,
                     "Radius of the orbit, in scene units; default: the scene fills\nthe image")
        ->type_name("X");
    raster
        ->add_option("--size", options->size,
                     "Size of the images, for an orbit, the random scene (default:\n"
                     "640x360) or a camera file that does not give it")
        ->type_name("WxH");
    raster->add_option("--scale", options->scale, "Multiply the size of the images by X")
        ->type_name("X");
    raster->add_option("--convention", options->convention, "3dgs or gsplat")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"3dgs", "gsplat"}));
    raster
        ->add_option("--background", options->background, "Background colour, each channel 0 to 1")
        ->type_name("R,G,B")
        ->default_str("0,0,0")
        ->delimiter(',')
        ->expected(3);
    add_device_option(*raster, options->device);
    raster->add_option("--seconds", options->seconds, "Time for each comparison")
        ->type_name("S")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 3600.0).description(""));
    raster->add_option("--samples", options->samples, "Number of pixels to compare with float64")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000).description(""));
    raster->add_flag("--no-plain", options->no_plain, "Measure the fast kernels only");
    raster->add_flag("--no-skips", options->no_skips, "Do not measure what each skip gains");
    raster->add_flag("--exact-pairs", options->exact_pairs,
                     "Count the pairs of tile and Gaussian that a pixel needs");
    add_json_flag(*raster, options->json);
    raster->add_option("--csv", options->csv, "Also write all figures as a CSV file")
        ->type_name("FILE");
    raster->add_option("--svg", options->svg, "Also draw the stages' times and the skips' gains")
        ->type_name("FILE");
    raster->callback([options, &exit_code] { exit_code = run_bench_raster(*options); });
}

}  // namespace vkrun
