// vkrun inspect: what a scene or a camera file holds. Needs no device.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/memory.h"
#include "vkrun/scene/scene_file.h"

namespace vkrun {
namespace {

constexpr const char* kInspectFooter =
    R"(
Cameras: a NeRF transforms.json, or the folder of a COLMAP model.

  memory      that the scene takes in host memory, and its copy on a device that draws it
  corners     of the box around all means (centres of Gaussians), in the axes RDF, whatever the
              frame of the file
  centre      median of the means; 95 % of them are within the radius around it
  scales      standard deviations along the axes of the Gaussians
  invisible   Gaussians of opacity below 1/255, which are never drawn
  degenerate  Gaussians with a scale below 1e-12
  fill ratio  about how many Gaussians lie one behind another: the areas of all 1-sigma ellipses
              over the mean face of the box that holds 98 % of the means along each axis, as
              splat-transform has it. Up to hundreds are usual; a scene of more draws slowly
  fov_x       horizontal field of view, degrees

Below "for other renderers" is what another program may take otherwise, or stumble over:

  frame       axes x, y and z of the file by their first letters: right or left, up or down, front
              or back
  drawn as    plain 3DGS: blended by depth, in display colours, without antialiasing; or those of
              "antialiased", "by distance", "3 sigma" (where a Gaussian ends) and "linear colours"
              that the file says
  colours     degree of the harmonics, and whether any colour depends on the direction
  .spz        whether .spz holds the scales: those from exp(-10) to exp(5.94)
  not finite  numbers of all attributes that are NaN or infinite
  bad rotations  quaternions of length 0, or not finite

A value that depends on an image size that the file lacks is "not given" (null in JSON).

Exit status: 0 done, 2 wrong usage, 4 the file cannot be read.

Examples:
  vkrun inspect scene.ply
  vkrun inspect scene.spz --json | jq .count
)";

struct InspectOptions {
    std::string path, size;
    bool ignore_distortion = false;
    bool lenient = false;
    bool json = false;
    std::uint64_t memory = 0;
};

std::string vector_text(const double* v) {
    return format("%.4g %.4g %.4g", v[0], v[1], v[2]);
}

/// "-y": the axis of the file that points up.
std::string up_axis(const SceneFile& file) {
    const auto frame = file.report.at("frame").get<std::string>();
    const std::size_t axis = frame.find_first_of("UD");
    return std::string(frame[axis] == 'U' ? "+" : "-") + "xyz"[axis];
}

std::string number_text(std::uint64_t n) {
    return format("%llu", static_cast<unsigned long long>(n));
}

void print_row(const char* name, const std::string& text) {
    std::printf("%-20s%s\n", name, text.c_str());
}

Json scene_json(const SceneFile& file) {
    const splat_scene_info& info = file.info;
    Json json = file.report;
    json["kind"] = "scene";
    json["low"] = std::vector<double>(info.low, info.low + 3);
    json["high"] = std::vector<double>(info.high, info.high + 3);
    json["center"] = std::vector<double>(info.center, info.center + 3);
    json["radius"] = info.radius;
    json["scale"] = {{"min", info.scale_min}, {"max", info.scale_max}, {"mean", info.scale_mean}};
    json["opacity"] = {
        {"min", info.opacity_min}, {"max", info.opacity_max}, {"mean", info.opacity_mean}};
    json["degenerate"] = info.degenerate;
    json["invisible"] = info.invisible;
    json["bytes"] = info.bytes;
    json["device_bytes"] = info.device_bytes;
    json["fill_ratio"] = info.fill_ratio;  // null if it is infinite
    json["up"] = up_axis(file);
    json["constant_colors"] = info.band_max == 0;
    json["beyond_spz"] = info.beyond_spz;
    return json;
}

/// What another renderer may take otherwise.
void print_for_renderers(const SceneFile& file) {
    const splat_scene_info& info = file.info;
    std::printf("for other renderers:\n");
    print_row("  frame", file.report.at("frame").get<std::string>() + ", up is " + up_axis(file));
    print_row("  drawn as", drawn_as_text(file));
    print_row("  colours",
              format("SH degree %u; %s", info.sh_degree,
                     info.band_max == 0 ? "the same from all sides" : "depend on the direction"));
    print_row("  .spz", info.beyond_spz == 0 ? "holds all scales"
                                             : "does not hold scales of " +
                                                   number_text(info.beyond_spz) + " Gaussians");
    print_row("  not finite", number_text(info.non_finite) + " numbers");
    print_row("  bad rotations", number_text(info.bad_rotations));
}

void print_scene(const SceneFile& file) {
    const splat_scene_info& info = file.info;
    const auto version = file.report.at("version").get<unsigned>();
    print_row("format", file.report.at("format").get<std::string>() +
                            (version != 0 ? format(", version %u", version) : ""));
    print_row("Gaussians", number_text(info.count));
    print_row("memory", bytes_text(info.bytes) + "; on a device " + bytes_text(info.device_bytes));
    print_row("low corner", vector_text(info.low));
    print_row("high corner", vector_text(info.high));
    print_row("centre", vector_text(info.center));
    print_row("radius", format("%.4g", info.radius));
    print_row("scales",
              format("%.3g to %.3g, mean %.3g", info.scale_min, info.scale_max, info.scale_mean));
    print_row("opacities", format("%.3g to %.3g, mean %.3g", info.opacity_min, info.opacity_max,
                                  info.opacity_mean));
    print_row("invisible", number_text(info.invisible));
    print_row("degenerate", number_text(info.degenerate));
    print_row("fill ratio", format("%.3g", info.fill_ratio));
    print_for_renderers(file);
    for (const Json& name : file.report.at("ignored"))
        print_row("ignored", name.get<std::string>());
}

/// Horizontal field of view, degrees.
double fov_x(const splat_camera& camera) {
    return 2 * std::atan(camera.width / (2 * camera.fx)) * 180 / std::numbers::pi;
}

/// A value of a camera; none if it depends on an unknown image size.
std::optional<double> given(const CameraFile& file, std::size_t i, bool size_known,
                            double (*value)(const splat_camera&)) {
    const double here = value(file.cameras[i]);
    // An angle does not depend on the size, except by rounding.
    const bool fixed = std::abs(here - value(file.resized[i])) <= 1e-9 * std::abs(here);
    return size_known || fixed ? std::optional(here) : std::nullopt;
}

struct CameraColumn {
    const char* name;
    const char* pattern;
    double (*value)(const splat_camera&);
};
constexpr CameraColumn kColumns[] = {
    {"width", "%.0f", [](const splat_camera& c) { return double{1} * c.width; }},
    {"height", "%.0f", [](const splat_camera& c) { return double{1} * c.height; }},
    {"fx", "%.2f", [](const splat_camera& c) { return c.fx; }},
    {"fy", "%.2f", [](const splat_camera& c) { return c.fy; }},
    {"cx", "%.2f", [](const splat_camera& c) { return c.cx; }},
    {"cy", "%.2f", [](const splat_camera& c) { return c.cy; }},
    {"fov_x", "%.2f", fov_x}};

Json cameras_json(const CameraFile& file, bool size_known) {
    Json list = Json::array();
    for (std::size_t i = 0; i < file.cameras.size(); ++i) {
        Json entry = {{"name", file.names[i]}};
        for (const CameraColumn& column : kColumns) {
            const auto value = given(file, i, size_known, column.value);
            const bool whole = std::string(column.pattern) == "%.0f";
            Json& cell = entry[column.name];
            if (value) cell = whole ? Json(static_cast<std::uint32_t>(*value)) : Json(*value);
        }
        const double* const pose = file.cameras[i].world_to_camera;
        entry["world_to_camera"] = std::vector<double>(pose, pose + 16);
        list.push_back(std::move(entry));
    }
    return {{"kind", "cameras"}, {"cameras", std::move(list)}, {"warnings", file.warnings}};
}

void print_cameras(const CameraFile& file, bool size_known) {
    std::vector<std::string> headings = {"image"};
    for (const CameraColumn& column : kColumns) headings.push_back(std::string(">") + column.name);
    Table table(headings);
    for (std::size_t i = 0; i < file.cameras.size(); ++i) {
        std::vector<std::string> cells = {file.names[i]};
        for (const CameraColumn& column : kColumns) {
            const auto value = given(file, i, size_known, column.value);
            cells.push_back(value ? format(column.pattern, *value) : "not given");
        }
        table.add(cells);
    }
    std::printf("%zu cameras\n%s", file.cameras.size(), table.text().c_str());
    for (const std::string& warning : file.warnings) std::printf("warning: %s\n", warning.c_str());
}

int run_inspect(const InspectOptions& options) {
    const std::string& path = options.path;
    std::error_code none;
    const bool cameras =
        !is_unpacked_sog(path) &&
        (std::filesystem::is_directory(splat::os::path_of(path), none) || path.ends_with(".json"));
    Json document;
    if (cameras) {
        const ImageSize size = image_size(options.size);
        if (options.lenient)
            throw Failure(kUsageError,
                          "--lenient is for scenes, and '" + path + "' is read as cameras");
        const CameraFile file = load_cameras(path, {size, options.ignore_distortion, true});
        if (!options.json) print_cameras(file, size.width != 0);
        document = cameras_json(file, size.width != 0);
    } else {
        if (!options.size.empty() || options.ignore_distortion)
            throw Failure(kUsageError,
                          std::string(options.size.empty() ? "--ignore-distortion" : "--size") +
                              " is for camera files, and '" + path + "' is read as a scene");
        const auto desc = scene_file_desc(options.lenient);
        check_memory(path, desc, options.memory);
        const SceneFile file = load_scene(path, &desc);
        if (!options.json) print_scene(file);
        document = scene_json(file);
    }
    document["file"] = path;
    if (options.json) print_json(document);
    return kSuccess;
}

}  // namespace

void add_inspect(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "inspect", "Show what a scene or a camera file holds.",
                                    "Scenes:\n" + scene_formats_text() + kInspectFooter);
    const auto options = std::make_shared<InspectOptions>();
    command
        ->add_option("FILE", options->path,
                     "Scene (a file, or the folder of an unpacked .sog),\ntransforms.json, or the "
                     "folder of a COLMAP model")
        ->required()
        ->type_name("");
    command
        ->add_option("--size", options->size,
                     "Size of the images, for a camera file that does not give it")
        ->type_name("WxH");
    command->add_flag("--ignore-distortion", options->ignore_distortion,
                      "Ignore the distortion of lenses");
    command->add_flag("--lenient", options->lenient, kLenientHelp);
    add_memory_option(*command, options->memory);
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = run_inspect(*options); });
}

}  // namespace vkrun
