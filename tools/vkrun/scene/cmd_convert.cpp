// vkrun convert: a scene file into another format. Only --force uses a device.

#include <CLI/CLI.hpp>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/predict/drawing.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/scene_file.h"

namespace vkrun {
namespace {

constexpr const char* kConvertFooter =
    R"(
The extension of OUT chooses the format. OUT is written whole or not at all.

A frame names the axes x, y and z by their first letters: right or left, up or down, front or back.
The table has the usual frame of each format.

Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage, 4 IN cannot be read.

Examples:
  vkrun convert scene.ply scene.spz
  vkrun convert scene.spz scene.ply --sh-degree 0 --overwrite
)";

struct ConvertOptions {
    std::string in, out;
    std::string frame = "auto";
    std::string in_frame = "auto";
    int sh_degree = -1;
    std::uint32_t spz_version = 0;
    bool lenient = false;
    bool force = false;
    bool overwrite = false;
    bool json = false;
};

/// Refuses options that the format of OUT does not support.
void check_options(const ConvertOptions& options) {
    std::string extension = std::filesystem::path(options.out).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (options.force && extension != ".spz")
        throw Failure(kUsageError, "--force is for .spz, and OUT is '" + options.out + "'");
    if (options.spz_version != 0 && extension != ".spz")
        throw Failure(kUsageError, "--spz-version is for .spz, and OUT is '" + options.out + "'");
    for (const Json& format : scene_formats()) {
        const int most = format.at("max_sh_degree").get<int>();
        if (format.at("extension") == extension && options.sh_degree > most)
            throw Failure(
                kUsageError,
                vkrun::format(
                    "--sh-degree is %d, but '%s' is a %s, which holds SH degree %d at most",
                    options.sh_degree, options.out.c_str(), extension.c_str(), most));
    }
}

/// PSNR in dB of OUT against IN, of kViews images around the scene; null where there is no device for it.
Json similarity(const SceneFile& in, const std::string& out) {
    constexpr std::uint32_t kViews = 8, kSide = 256;
    const float gray[] = {0.5F, 0.5F, 0.5F};
    try {
        const Device device = open_device(device_desc("best"));
        const auto desc = scene_file_desc(false);
        const SceneFile written = load_scene(out, &desc);
        const auto cameras = orbit_cameras(in.scene.get(), {kSide, kSide}, 20, 0, kViews);
        const auto a = draw_scene(device.get(), in.scene, cameras, gray);
        const auto b = draw_scene(device.get(), written.scene, cameras, gray);
        double squares = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            squares += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
        return squares > 0 ? -10 * std::log10(squares / static_cast<double>(a.size())) : 100;
    } catch (const Failure& failure) {
        std::fprintf(stderr, "vkrun: warning: what OUT has lost is not measured: %s\n",
                     failure.what());
        return nullptr;
    }
}

int run_convert(const ConvertOptions& options) {
    check_options(options);
    auto read = scene_file_desc(options.lenient);
    read.frame = frame_of(options.in_frame);
    auto write = sized<splat_scene_file_desc>();
    write.frame = frame_of(options.frame);
    if (options.sh_degree >= 0)
        write.sh_degree = options.sh_degree == 0 ? SPLAT_SH_CONSTANT : options.sh_degree;
    write.spz_version = options.spz_version;
    if (options.force) write.flags = SPLAT_SCENE_CLAMP;
    check_target(options.out, options.overwrite);
    const SceneFile file = load_scene(options.in, &read);
    check(splat_scene_save(file.scene.get(), options.out.c_str(), &write));
    const std::uintmax_t before = std::filesystem::file_size(options.in);
    const std::uintmax_t after = std::filesystem::file_size(options.out);
    const Json psnr = options.force ? similarity(file, options.out) : Json(nullptr);
    if (options.json) {
        Json document = {{"in", options.in},
                         {"out", options.out},
                         {"report", file.report},
                         {"in_bytes", before},
                         {"out_bytes", after}};
        if (options.force) document["psnr"] = psnr;
        print_json(document);
        return kSuccess;
    }
    std::printf("%s: %llu Gaussians, %s -> %s\n", options.out.c_str(),
                static_cast<unsigned long long>(file.info.count), bytes_text(before).c_str(),
                bytes_text(after).c_str());
    if (psnr.is_number())
        std::printf("images of OUT against those of IN: %.1f dB\n", psnr.get<double>());
    for (const Json& name : file.report.at("ignored"))
        std::fprintf(stderr, "vkrun: warning: '%s' of %s is not kept\n",
                     name.get<std::string>().c_str(), options.in.c_str());
    return kSuccess;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "convert", "Write a scene file in another format.",
                                    scene_formats_text() + kConvertFooter);
    const auto options = std::make_shared<ConvertOptions>();
    command->add_option("IN", options->in, "Scene to read")->required()->type_name("");
    command->add_option("OUT", options->out, "Scene to write: " + scene_extensions(true))
        ->required()
        ->type_name("");
    command->add_option("--frame", options->frame, "Axes of OUT; default: those in the table below")
        ->type_name("FRAME");
    command
        ->add_option("--in-frame", options->in_frame,
                     "Axes of IN; default: those in the table below")
        ->type_name("FRAME");
    command
        ->add_option("--sh-degree", options->sh_degree,
                     "Degree of spherical harmonics of OUT; default: that of IN")
        ->type_name("N")
        ->check(CLI::Range(0, 3).description(""));
    command
        ->add_option("--spz-version", options->spz_version,
                     "Version of a .spz file, 3 or 4; default: 3")
        ->type_name("N")
        ->check(CLI::Range(3, 4).description(""));
    command->add_flag("--lenient", options->lenient, kLenientHelp);
    command->add_flag(
        "--force", options->force,
        "Write a .spz file even if more than 1 % of the Gaussians have scales that it\n"
        "does not hold, with the nearest ones, and measure what that changes");
    add_overwrite_flag(*command, options->overwrite, "OUT");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = run_convert(*options); });
}

}  // namespace vkrun
