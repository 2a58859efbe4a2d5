#include "vkrun/scene/render_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
#include "raster_constants.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/memory.h"
#include "vkrun/scene/scene_file.h"

namespace vkrun {
namespace {

using splat::raster::kFarGsplat;
using splat::raster::kNear3dgs;
using splat::raster::kNearGsplat;

/// Checks --near and --far, each also against what the library takes for the other where it is not given.
void check_planes(const RenderOptions& options) {
    for (const auto& [name, plane] :
         {std::pair{"--near", options.near_plane}, std::pair{"--far", options.far_plane}})
        if (plane) check_number(name, static_cast<double>(*plane), 1e-6, 1e30);
    const float usual_near = options.convention == "gsplat" ? kNearGsplat : kNear3dgs;
    const auto near = static_cast<double>(options.near_plane.value_or(usual_near));
    const auto far = static_cast<double>(options.far_plane.value_or(kFarGsplat));
    if (far > near) return;
    if (!options.far_plane)
        throw Failure(kUsageError, format("--near is %g, expected less than --far, %g by default; "
                                          "give both",
                                          near, far));
    throw Failure(kUsageError, format("--far is %g, expected more than --near, %g%s", far, near,
                                      options.near_plane ? "" : " by default; give both"));
}

/// What the images show, and from where.
void add_camera_options(CLI::App& command, RenderOptions& options) {
    command.add_option("SCENE", options.scene, "Scene: " + scene_extensions())
        ->required()
        ->type_name("");
    command
        .add_option("--cameras", options.cameras,
                    "transforms.json, or the folder of a COLMAP model")
        ->type_name("FILE");
    command.add_option("--orbit", options.orbit, "N cameras on a circle around the scene")
        ->type_name("N")
        ->check(CLI::Range(1, 10000).description(""));
    command
        .add_option("--path", options.path,
                    "A smooth path through the cameras of a transforms.json, a COLMAP\nmodel or a "
                    "folder of photographs, by their names; or orbit")
        ->type_name("FILE");
    CLI::Option* const frames =
        command.add_option("--frames", options.frames, "Images of the path")
            ->type_name("N")
            ->capture_default_str()
            ->check(CLI::Range(1, 100000).description(""));
    CLI::Option* const closed =
        command.add_flag("--closed", options.closed, "The path returns to its first camera");
    frames->needs("--path");
    closed->needs("--path");
    command
        .add_option("--elevation", options.elevation,
                    "Degrees of the orbit above the horizon; default: 11")
        ->type_name("DEG");
    command
        .add_option(
            "--distance", options.distance,
            "Radius of the orbit, in scene units; default: all of\nthe scene is in every image")
        ->type_name("X");
    command
        .add_option("--out", options.out,
                    "Folder for the images, made if it is missing; or the file\nof the only image, "
                    ".png or .npy")
        ->required()
        ->type_name("DIR");
    command
        .add_option("--size", options.size,
                    "Size of the images, for an orbit (default: 512x512)\nor a camera file that "
                    "does not give it")
        ->type_name("WxH");
}

}  // namespace

void check_render_options(const RenderOptions& options) {
    if ((options.orbit != 0 ? 1 : 0) + (options.cameras.empty() ? 0 : 1) +
            (options.path.empty() ? 0 : 1) !=
        1)
        throw Failure(kUsageError, "give either --cameras FILE or --orbit N or --path FILE");
    if (options.orbit == 0 && (options.elevation || options.distance))
        throw Failure(kUsageError, std::string(options.elevation ? "--elevation" : "--distance") +
                                       " is for --orbit; the file of " +
                                       (options.path.empty() ? "--cameras" : "--path") +
                                       " places its cameras itself");
    if (options.ignore_distortion && options.cameras.empty())
        throw Failure(kUsageError,
                      "--ignore-distortion is for --cameras; an orbit has no distortion");
    if (options.elevation) check_number("--elevation", *options.elevation, -89, 89);
    if (options.distance) check_number("--distance", *options.distance, 1e-6, 1e9);
    check_planes(options);
    if (!options.page.empty() && options.format != "png")
        throw Failure(kUsageError,
                      "--page shows the images, which a browser reads with --format png");
    check_background(options.background);
    if (options.animate &&
        std::find(options.outputs.begin(), options.outputs.end(), "rgb") == options.outputs.end())
        throw Failure(kUsageError, "--animate needs rgb among the --outputs");
    const std::string kind = splat::os::text_of(splat::os::path_of(options.animation).extension());
    if (!options.animation.empty() && kind != ".png" && kind != ".gif" && kind != ".webp")
        throw Failure(kUsageError, "--animate is '" + options.animation +
                                       "', expected a file of the extension .png, .gif or .webp");
}

void place_images(RenderOptions& options, std::size_t images) {
    const std::filesystem::path out = splat::os::path_of(options.out);
    const std::string extension = extension_of(out);
    std::error_code none;
    const bool folder = std::filesystem::is_directory(out, none);
    for (const char* other : {".jpg", ".jpeg", ".webp", ".gif", ".tif", ".tiff", ".exr", ".bmp"})
        if (!folder && extension == other)
            throw Failure(
                kUsageError,
                "--out is '" + options.out +
                    "', but images are written as .png or .npy; name a folder, or one such "
                    "file for a single image");
    if (!folder && (extension == ".png" || extension == ".npy")) {
        if (options.format == "npy" && extension == ".png")
            throw Failure(kUsageError, "--out is '" + options.out + "', but --format is npy");
        options.format = extension.substr(1);
        if (images != 1)
            throw Failure(kUsageError,
                          format("--out is the file '%s', but there are %zu images: name a folder",
                                 options.out.c_str(), images));
        options.file = options.out;
        options.out = splat::os::text_of(out.parent_path());
    }
    if (options.animation.empty())
        options.animation = splat::os::text_of(splat::os::path_of(options.out) / "animation.png");
}

void add_render_options(CLI::App& command, RenderOptions& options) {
    add_camera_options(command, options);
    command.add_flag("--ignore-distortion", options.ignore_distortion,
                     "Ignore the distortion of lenses");
    command.add_flag("--lenient", options.lenient,
                     std::string(kLenientHelp) + ", and\nof cameras more than 1e6 radii away");
    command
        .add_option("--near", options.near_plane,
                    format("Near plane, in scene units; default: %g, with\n--convention gsplat %g",
                           static_cast<double>(kNear3dgs), static_cast<double>(kNearGsplat)))
        ->type_name("X");
    command.add_option("--far", options.far_plane, "Far plane, in scene units; default: 1e10")
        ->type_name("X");
    command.add_option("--format", options.format, "png or npy")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"png", "npy"}));
    command.add_option("--convention", options.convention, "3dgs, gsplat or ray_maximum")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"3dgs", "gsplat", "ray_maximum"}));
    add_drawn_as_option(command, options.drawn_as);
    command.add_flag("--antialiased", options.antialiased,
                     "Compensate opacities for the dilation, whatever the file says");
    command
        .add_option("--background", options.background, "Background colour, each channel 0 to 1")
        ->type_name("R,G,B")
        ->default_str("0,0,0")
        ->delimiter(',')
        ->expected(3);
    command.add_option("--outputs", options.outputs, "Any of rgb, alpha, depth, median and normal")
        ->type_name("NAME[,NAME]...")
        ->default_str("rgb")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(one_of({"rgb", "alpha", "depth", "median", "normal"}));
    command
        .add_option_function<std::string>(
            "--animate",
            [&options](const std::string& path) {
                options.animate = true;
                options.animation = path;
            },
            "Also write an animation of all views: FILE.png,\nFILE.gif or FILE.webp; default: "
            "DIR/animation.png")
        ->expected(0, 1)
        ->default_str("")
        ->type_name("[FILE]");
    command
        .add_option("--page", options.page,
                    "Also write a page with the images, in which the scene\nturns as in that of "
                    "'vkrun view'")
        ->type_name("FILE");
    command.add_flag("--overwrite", options.overwrite, "Replace images that exist");
    add_memory_option(command, options.memory);
    add_device_option(command, options.device);
    add_json_flag(command, options.json);
}

}  // namespace vkrun
