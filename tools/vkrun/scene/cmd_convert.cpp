// vkrun convert: a scene file into another format. Only --force uses a device.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
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
#include "vkrun/scene/memory.h"
#include "vkrun/scene/scene_edits.h"

namespace vkrun {
namespace {

constexpr const char* kConvertFooter =
    R"(
The extension of OUT chooses the format. OUT is written whole or not at all.

A frame names the axes x, y and z by their first letters: right or left, up or down, front or back.
The table has the usual frame of each format.

Edits may be repeated and are made one after the other, as the command line has them, before OUT is
written. Their numbers are in the axes RDF, in which 'vkrun inspect' prints bounds for all formats;
--edit-frame names others. Numbers for splat-transform are in LUF.

)";

constexpr const char* kConvertExamples =
    R"(
Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage, 4 IN or FILE cannot be read.

Examples:
  vkrun convert scene.ply scene.spz
  vkrun convert scene.spz scene.ply --sh-degree 0 --overwrite
  vkrun convert room.ply chair.ply --crop-sphere 0.4,0.1,2,0.8 --filter-nan --min-opacity 0.02
  vkrun convert a.ply both.ply --rotate 0,90,0 --merge b.spz --order morton
)";

struct ConvertOptions {
    std::string in, out;
    std::string frame = "auto";
    std::string in_frame = "auto";
    std::string edit_frame = "RDF";
    std::vector<SceneEdit> edits;
    std::uint32_t spz_version = 0;
    bool lenient = false;
    bool force = false;
    bool overwrite = false;
    bool json = false;
    std::uint64_t memory = 0;
};

/// Refuses options that the format of OUT does not support.
void check_options(const ConvertOptions& options) {
    const Json* const format = named_format(options.out, true);
    if (format == nullptr)
        throw Failure(kFailed, "'" + options.out + "': extension '" + extension_of(options.out) +
                                   "', expected " + scene_extensions(true));
    const auto extension = format->at("extension").get<std::string>();
    if (options.force && extension != ".spz")
        throw Failure(kUsageError, "--force is for .spz, and OUT is '" + options.out + "'");
    if (options.spz_version != 0 && extension != ".spz")
        throw Failure(kUsageError, "--spz-version is for .spz, and OUT is '" + options.out + "'");
    const int most = format->at("max_sh_degree").get<int>();
    const int degree = sh_degree_of(options.edits);
    if (degree > most)
        throw Failure(
            kUsageError,
            vkrun::format("--sh-degree is %d, but '%s' is a %s, which holds SH degree %d at most",
                          degree, options.out.c_str(), extension.c_str(), most));
}

/// PSNR in dB of OUT against IN, of kViews images around the scene; null where there is no device for it.
Json similarity(const SceneFile& in, const std::string& out, splat_frame frame) {
    constexpr std::uint32_t kViews = 8, kSide = 256;
    const float gray[] = {0.5F, 0.5F, 0.5F};
    try {
        const Device device = open_device(device_desc("best"));
        auto desc = scene_file_desc(false);
        desc.frame = frame;
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

splat_frame edit_frame_of(const std::string& name) {
    if (name == "auto") throw Failure(kUsageError, "--edit-frame is 'auto', expected axes, as RDF");
    return frame_of(name);
}

Json edits_json(const std::vector<EditResult>& edits) {
    Json list = Json::array();
    for (const EditResult& edit : edits)
        list.push_back({{"edit", edit.edit}, {"count", edit.count}, {"changed", edit.changed}});
    return list;
}

void print_edits(const std::vector<EditResult>& edits, std::uint64_t before) {
    for (const EditResult& edit : edits) {
        std::printf("%s: %llu of %llu Gaussians%s\n", edit.edit.c_str(),
                    static_cast<unsigned long long>(edit.count),
                    static_cast<unsigned long long>(before),
                    edit.changed ? "" : ", nothing has changed");
        before = edit.count;
    }
}

int run_convert(const ConvertOptions& options) {
    check_options(options);
    auto read = scene_file_desc(options.lenient);
    read.frame = frame_of(options.in_frame);
    auto write = sized<splat_scene_file_desc>();
    write.frame = frame_of(options.frame);
    write.spz_version = options.spz_version;
    if (options.force) write.flags = SPLAT_SCENE_CLAMP;
    const EditOptions editing = {edit_frame_of(options.edit_frame), options.lenient};
    check_target(options.out, options.overwrite);
    check_folder_of(options.out);
    check_memory(options.in, read, options.memory,
                 {merged_files(options.edits),
                  sh_degree_of(options.edits),
                  {},
                  options.out,
                  !options.edits.empty()});
    SceneFile file = load_scene(options.in, &read);
    const std::vector<EditResult> edits = apply_edits(file, options.edits, editing);
    const std::uint64_t before = scene_bytes(options.in);  // OUT may be IN
    check(splat_scene_save(file.scene.get(), options.out.c_str(), &write));
    const std::uint64_t count = edits.empty() ? file.info.count : edits.back().count;
    const std::uint64_t after = scene_bytes(options.out);
    const Json psnr = options.force ? similarity(file, options.out, write.frame) : Json(nullptr);
    if (options.json) {
        Json document = {{"in", options.in},      {"out", options.out},
                         {"report", file.report}, {"edits", edits_json(edits)},
                         {"count", count},        {"in_bytes", before},
                         {"out_bytes", after}};
        if (options.force) document["psnr"] = psnr;
        print_json(document);
        return kSuccess;
    }
    print_edits(edits, file.info.count);
    std::printf("%s: %llu Gaussians, %s -> %s\n", options.out.c_str(),
                static_cast<unsigned long long>(count), bytes_text(before).c_str(),
                bytes_text(after).c_str());
    if (psnr.is_number())
        std::printf("images of OUT against those of IN: %.1f dB\n", psnr.get<double>());
    warn_ignored(file, options.in);
    return kSuccess;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "convert", "Write a scene file in another format.",
                    scene_formats_text() + kConvertFooter + edits_text() + kConvertExamples);
    const auto options = std::make_shared<ConvertOptions>();
    command
        ->add_option("IN", options->in, "Scene to read: a file, or the folder of an unpacked .sog")
        ->required()
        ->type_name("");
    command->add_option("OUT", options->out, "Scene to write: " + scene_extensions(true))
        ->required()
        ->type_name("");
    command->add_option("--frame", options->frame, "Axes of OUT; default: those in the table below")
        ->type_name("FRAME")
        ->check(any_like(frame_names()));
    command
        ->add_option("--in-frame", options->in_frame,
                     "Axes of IN; default: those in the table below")
        ->type_name("FRAME")
        ->check(any_like(frame_names()));
    command->add_option("--edit-frame", options->edit_frame, "Axes of the numbers of edits")
        ->type_name("FRAME")
        ->check(any_like(frame_names()))
        ->capture_default_str();
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
    add_memory_option(*command, options->memory);
    add_overwrite_flag(*command, options->overwrite, "OUT");
    add_json_flag(*command, options->json);
    add_edit_options(*command);
    command->callback([options, command, &exit_code] {
        options->edits = edits_of(*command);
        exit_code = run_convert(*options);
    });
}

}  // namespace vkrun
