// vkrun inspect: what a scene or a camera file holds. Needs no device.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "vkrun/command.h"
#include "vkrun/scene_input.h"
#include "vkrun/table.h"

namespace vkrun {
namespace {

constexpr const char* kInspectFooter =
    R"(Scenes: 3DGS .ply (plain, compressed), .splat, .spz. Cameras: a NeRF transforms.json, or the
folder of a COLMAP model.

  frame       axes of the file: right or left, up or down, front or back
  centre      median of the means; 95 % of them are within the radius around it
  invisible   Gaussians of opacity below 1/255, which are never drawn
  degenerate  Gaussians with a scale below 1e-12

Exit status: 0 it can be read, 1 it cannot, 2 wrong usage.

Examples:
  vkrun inspect scene.ply
  vkrun inspect scene.spz --json | jq .count
)";

std::string vector_text(const double* v) {
    return format("%.4g %.4g %.4g", v[0], v[1], v[2]);
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
    return json;
}

void print_scene(const SceneFile& file) {
    const splat_scene_info& info = file.info;
    const auto row = [](const char* name, const std::string& text) {
        std::printf("%-20s%s\n", name, text.c_str());
    };
    const auto number = [](std::uint64_t n) {
        return format("%llu", static_cast<unsigned long long>(n));
    };
    const auto version = file.report.at("version").get<unsigned>();
    row("format", file.report.at("format").get<std::string>() +
                      (version != 0 ? format(", version %u", version) : ""));
    row("Gaussians", number(info.count));
    row("SH degree", format("%u", info.sh_degree));
    row("frame", file.report.at("frame").get<std::string>());
    row("low corner", vector_text(info.low));
    row("high corner", vector_text(info.high));
    row("centre", vector_text(info.center));
    row("radius", format("%.4g", info.radius));
    row("scales",
        format("%.3g to %.3g, mean %.3g", info.scale_min, info.scale_max, info.scale_mean));
    row("opacities",
        format("%.3g to %.3g, mean %.3g", info.opacity_min, info.opacity_max, info.opacity_mean));
    row("invisible", number(info.invisible));
    row("degenerate", number(info.degenerate));
    row("not finite", number(info.non_finite));
    row("bad rotations", number(info.bad_rotations));
    for (const Json& name : file.report.at("ignored")) row("ignored", name.get<std::string>());
}

Json cameras_json(const CameraFile& file) {
    Json list = Json::array();
    for (std::size_t i = 0; i < file.cameras.size(); ++i) {
        const splat_camera& camera = file.cameras[i];
        list.push_back({{"name", file.names[i]},
                        {"width", camera.width},
                        {"height", camera.height},
                        {"fx", camera.fx},
                        {"fy", camera.fy},
                        {"cx", camera.cx},
                        {"cy", camera.cy},
                        {"world_to_camera", std::vector<double>(camera.world_to_camera,
                                                                camera.world_to_camera + 16)}});
    }
    return {{"kind", "cameras"}, {"cameras", std::move(list)}, {"warnings", file.warnings}};
}

void print_cameras(const CameraFile& file) {
    Table table({"image", ">width", ">height", ">fx", ">fy", ">cx", ">cy"});
    for (std::size_t i = 0; i < file.cameras.size(); ++i) {
        const splat_camera& c = file.cameras[i];
        table.add({file.names[i], format("%u", c.width), format("%u", c.height),
                   format("%.2f", c.fx), format("%.2f", c.fy), format("%.2f", c.cx),
                   format("%.2f", c.cy)});
    }
    std::printf("%zu cameras\n%s", file.cameras.size(), table.text().c_str());
    for (const std::string& warning : file.warnings) std::printf("warning: %s\n", warning.c_str());
}

int run_inspect(const std::string& path, bool json) {
    const bool cameras = std::filesystem::is_directory(path) || path.ends_with(".json");
    Json document;
    if (cameras) {
        const CameraFile file = load_cameras(path, 0, 0);
        if (!json) print_cameras(file);
        document = cameras_json(file);
    } else {
        const SceneFile file = load_scene(path);
        if (!json) print_scene(file);
        document = scene_json(file);
    }
    document["file"] = path;
    if (json) std::printf("%s\n", json_text(document).c_str());
    return kSuccess;
}

}  // namespace

void add_inspect(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("inspect", "Tell what a scene or a camera file holds.");
    command->group("Commands");
    const auto path = std::make_shared<std::string>();
    const auto json = std::make_shared<bool>(false);
    command->add_option("FILE", *path, "Scene, transforms.json, or folder of a COLMAP model")
        ->required()
        ->type_name("");
    command->add_flag("--json", *json, "Print one JSON object on standard output");
    command->footer(kInspectFooter);
    command->callback([path, json, &exit_code] { exit_code = run_inspect(*path, *json); });
}

}  // namespace vkrun
