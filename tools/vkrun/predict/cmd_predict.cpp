// vkrun predict: from one picture to a scene.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/text.h"
#include "vkrun/predict/prediction.h"

namespace vkrun {
namespace {

constexpr const char* kPredictFooter =
    R"(IMAGE is a picture of one object, of any size. The object is cut out by --mask, by the image's alpha (unless it
is opaque everywhere), by a network (--mask-preset, --mask-model or SPLAT_MASK_MODEL, else one of 'vkrun priors
where' whose file is there), or by its difference from the colour of the border, and centred in a white square. A
picture in which none of these finds an object is taken whole, with a warning. Instead of a picture, --data and
--object take an object of a data set, and the prediction is compared with its images.

Networks with focal lengths of their own (data.fov 0) take that of the picture's Exif data, or --focal. What lacks of
depth, normals and focal length, and a mask where nothing else finds an object, comes from one pass of --geometry, else
of a preset moge-2-... of 'vkrun priors where' whose file is there; the output says what came from it.

OUT gets scene.ply, input.png, novel views (view_NN.png), orbit.png (animated), sheet.png and report.html,
which holds all pictures and facts, and in which the scene turns; those of an earlier run are replaced. Gaussians
with an opacity below 1/255, which no image shows, and those with numbers that are not finite are left out of the
scene and counted ("faint", "not_finite").

Without --weights, the built-in ones are used: procedural cars at 64 x 64 pixels, for which there are the adapters
"chairs"; with --depth and --normal those of the name cars64-depth-normal. Of other objects they make cars;
'vkrun weights where' lists published weights. Warns if no object is found, and then uses the whole picture,
or if the object touches the border.

A network whose head takes depths (model.head f3d, such as F3D-Gaus) needs --depth or --geometry, and sees pictures
whole, over the background only where --mask or an alpha is given. The map's least and greatest numbers lie at
data.znear and data.zfar; --larger says which is which of --depth: 'farther' as LeReS and the preset f3d-gaus-256 have
it, 'nearer' as 'vkrun priors depth' and --geometry.

Exit status: 0 done, 1 failed, 2 wrong usage or configuration, 3 no device, 4 bad data, 7 weights whose
outputs are not finite.

Examples:
  vkrun predict photo.png --out out
  vkrun predict photo.jpg --mask-preset u2net --out out
  vkrun predict render.png --whole --weights model_best.pth --config config.yaml --out out
  vkrun predict photo.png --depth depth.png --weights checkpoint_256x256_v1.pt --aggregate 8
  vkrun predict --data cars --split test --object 0 --out out
  vkrun predict --data chairs --split test --object 0 --adapters chairs --out out
)";

/// Throws a usage Failure for options that have no effect together.
void check_options(const CLI::App& command, const PredictionOptions& options) {
    if (options.images.empty() == options.data.empty())
        throw Failure(kUsageError, options.images.empty()
                                       ? "name an IMAGE, or a data set with --data"
                                       : "IMAGE and --data exclude each other");
    for (const char* name : {"--object", "--split"})
        if (options.data.empty() && command.count(name) != 0)
            throw Failure(kUsageError, std::string(name) + " goes with --data, not with a picture");
    if (!options.data.empty() && command.count("--elevation") != 0)
        throw Failure(kUsageError,
                      "--elevation goes with a picture; the data set places its cameras itself");
    if (!options.data.empty() && !options.true_depth.empty())
        throw Failure(kUsageError, "--true-depth goes with a picture, not with --data");
    for (const char* name :
         {"--mask", "--depth", "--normal", "--embedding", "--tokens", "--mask-preset",
          "--mask-model", "--geometry", "--foreground", "--true-depth", "--aggregate"})
        if (options.images.size() > 1 && command.count(name) != 0)
            throw Failure(kUsageError,
                          std::string(name) + " goes with one IMAGE, not with several");
    const bool cut = options.whole || options.foreground || !options.mask.empty() ||
                     !options.depth.empty() || !options.normal.empty() ||
                     !options.embedding.empty() || !options.tokens.empty() || options.focal ||
                     options.origin_distance;
    if (!options.data.empty() && cut)
        throw Failure(kUsageError,
                      "--mask, --depth, --normal, --embedding, --tokens, --whole, --foreground, "
                      "--focal and --origin-distance go with a picture, not with --data");
    if (!options.larger.empty() && options.depth.empty())
        throw Failure(kUsageError, "--larger goes with --depth, which it is about");
    if (options.whole && options.foreground)
        throw Failure(kUsageError, "--foreground has no effect with --whole: nothing is cut out");
    const bool by_network = !options.mask_model.empty() || !options.mask_preset.empty();
    if (!options.geometry.empty() && !options.data.empty())
        throw Failure(kUsageError, "--geometry goes with a picture, not with --data");
    if (by_network && (!options.mask.empty() || options.whole || !options.data.empty()))
        throw Failure(
            kUsageError,
            "--mask-preset and --mask-model go with a picture, without --mask and --whole");
    check_number("--elevation", options.elevation, -89, 89);
    check_number("--views", options.views, 1, 10000);
    if (options.focal) check_number("--focal", *options.focal, 1, 1e6);
    if (options.origin_distance)
        check_number("--origin-distance", *options.origin_distance, 1e-6, 1e6);
    if (options.foreground)
        check_number("--foreground", static_cast<double>(*options.foreground), 0.051, 1);
}

/// Throws a usage Failure if a file that is read is one of those that are written, or removed: the
/// further views of an earlier run.
void check_targets(const PredictionOptions& o) {
    const auto check = [&o](const std::string& path) {
        check_target(path, true, o.images);
        check_target(path, true,
                     {o.mask, o.depth, o.normal, o.embedding, o.tokens, o.true_depth, o.weights,
                      o.config, o.adapters});
    };
    for (const char* name : {"scene.ply", "input.png", "orbit.png", "sheet.png", "report.html"})
        check(o.out + "/" + name);
    std::error_code none;
    for (std::uint32_t i = 0;; ++i) {
        const std::string path = o.out + format("/view_%02u.png", i);
        if (i >= o.views && !std::filesystem::exists(splat::os::path_of(path), none)) break;
        check(path);
    }
}

std::string joined_words(const Json& words) {
    std::string all;
    for (const Json& word : words) all += (all.empty() ? "" : ", ") + word.get<std::string>();
    return all;
}

int predict(const CLI::App& command, const PredictionOptions& options, bool json) {
    check_options(command, options);
    check_no_run(options.out, "predicted");
    check_targets(options);
    std::vector<std::string> changes;
    if (!options.larger.empty()) changes.push_back("model.head.depth_maps=" + options.larger);
    NetworkFiles files =
        network_files(weights_of(options), options.config, options.adapters, changes);
    const auto positions = files.config.value("/model/head/positions"_json_pointer, std::string());
    const bool takes_depths = positions == "input_depth";
    if (!takes_depths && !options.larger.empty())
        throw Failure(kUsageError, "--larger: the head of the network takes no depths");
    // Larger is nearer in the maps of --geometry.
    if (takes_depths && options.depth.empty())
        files.config["model"]["head"]["depth_maps"] = "nearer";
    check_pictures(options, files.config);
    const Device device = open_device(device_desc(options.device));
    const Joining joining{options.aggregate, convention_of(options.convention)};
    const Json result =
        run_prediction(options, device.get(), load_network(device.get(), files, nullptr, joining));
    if (json) {
        print_json(result);
        return kSuccess;
    }
    const Json photo = result.value("photo", Json::object());
    if (photo.contains("geometry"))
        std::printf("%s by %s\n", joined_words(photo.at("geometry").at("used")).c_str(),
                    photo.at("geometry").at("preset").get<std::string>().c_str());
    std::printf("weights trained for %s\n", result.at("trained_for").get<std::string>().c_str());
    std::printf(
        "%u Gaussians (%u faint and %u not finite ones were left out) in %.0f ms; %u images "
        "in %.0f ms\n",
        result.at("gaussians").get<unsigned>(), result.at("faint").get<unsigned>(),
        result.at("not_finite").get<unsigned>(), result.at("predict_ms").get<double>(),
        result.at("images").get<unsigned>(), result.at("draw_ms").get<double>());
    if (result.contains("psnr"))
        std::printf(
            "against the truth: PSNR %.2f dB, SSIM %.4f on %u novel views (input view %.2f dB)\n",
            result.at("psnr").get<double>(), result.at("ssim").get<double>(),
            result.at("novel_views").get<unsigned>(), result.at("psnr_input").get<double>());
    if (result.contains("depth"))
        std::printf(
            "depth against %s, scaled and shifted: mean error %.3f of its range, correlation "
            "%.3f\n",
            options.true_depth.c_str(), result.at("depth").at("error").get<double>(),
            result.at("depth").at("correlation").get<double>());
    std::printf("%s\n", result.at("report").get<std::string>().c_str());
    return kSuccess;
}

/// What goes with the picture.
void add_map_options(CLI::App& command, PredictionOptions& o) {
    command.add_option("--mask", o.mask, "Mask of the object, of the size of IMAGE")
        ->type_name("FILE");
    command.add_option("--depth", o.depth, "Depth map, for networks that take one")
        ->type_name("FILE");
    command
        .add_option(
            "--larger", o.larger,
            "What larger numbers of --depth are, nearer or farther, for networks whose head "
            "takes\ndepths; default: the configuration's model.head.depth_maps")
        ->type_name("WORD")
        ->check(CLI::IsMember({"nearer", "farther"}));
    command.add_option("--normal", o.normal, "Normal map, for networks that take one")
        ->type_name("FILE");
    command
        .add_option("--embedding", o.embedding,
                    "The picture's embedding, for networks that take one: .npz or .safetensors of "
                    "one array")
        ->type_name("FILE");
    command
        .add_option("--tokens", o.tokens,
                    "Its tokens, for networks that take them: such a file of [token_dim, tokens]")
        ->type_name("FILE");
}

/// What is drawn, and predicted again.
void add_view_options(CLI::App& command, PredictionOptions& o) {
    command.add_option("--views", o.views, "Number of novel views")
        ->type_name("N")
        ->capture_default_str();
    command.add_option("--elevation", o.elevation, "Degrees of the orbit above the horizon")
        ->type_name("DEG")
        ->capture_default_str();
    command
        .add_option("--true-depth", o.true_depth,
                    "True depth map of IMAGE to compare with, at any scale; larger is farther")
        ->type_name("FILE");
    command
        .add_option("--aggregate", o.aggregate,
                    "Predict from so many drawn views of the prediction as well, and join all; "
                    "F3D-Gaus\nhas 8")
        ->type_name("N");
    command
        .add_option("--convention", o.convention,
                    "How these views and the results are drawn: 3dgs, or ray_maximum as F3D-Gaus")
        ->type_name("NAME")
        ->check(CLI::IsMember({"3dgs", "ray_maximum"}))
        ->capture_default_str();
}

}  // namespace

void add_predict(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "predict", "Turn a picture into a scene.", kPredictFooter);
    auto options = std::make_shared<PredictionOptions>();
    auto json = std::make_shared<bool>(false);
    PredictionOptions& o = *options;
    command
        ->add_option(
            "IMAGE", o.images,
            "Picture of one object (PNG, JPEG, WebP); or its views, for networks that take "
            "several")
        ->type_name("");
    command
        ->add_option("--data", o.data, "Folder of a data set that has the object, instead of IMAGE")
        ->type_name("DIR");
    command->add_option("--split", o.split, "Split of --data: train, val or test")
        ->type_name("NAME")
        ->capture_default_str();
    command->add_option("--object", o.object, "Number of the object in --split, from 0")
        ->type_name("N")
        ->capture_default_str();
    command
        ->add_option("--weights", o.weights,
                     "Weights of the network: .safetensors, .pth or .npz, or the name of built-in\n"
                     "ones; default: cars64")
        ->type_name("FILE");
    add_network_options(*command, o.config, o.adapters);
    add_map_options(*command, o);
    command
        ->add_option("--mask-preset", o.mask_preset,
                     "Kind of model that makes the mask, where IMAGE has no alpha that does")
        ->type_name("NAME");
    command
        ->add_option("--mask-model", o.mask_model,
                     "File of that model (ONNX); default: SPLAT_MASK_MODEL, else the preset's")
        ->type_name("FILE");
    command
        ->add_option("--geometry", o.geometry,
                     "Network that makes depth, normals, mask and focal length in one pass, where\n"
                     "they lack: a preset, or a file (weights of MoGe-2); default: one at hand")
        ->type_name("NAME");
    command->add_flag("--whole", o.whole,
                      "Use the central square instead of cutting out the object");
    command->add_option("--foreground", o.foreground, "Share of the square that the object fills")
        ->type_name("X")
        ->default_str("0.65");
    command->add_option("--focal", o.focal, "Focal length, pixels; default: by Exif data")
        ->type_name("X");
    command
        ->add_option("--origin-distance", o.origin_distance,
                     "Distance of the object's origin, for networks that take it")
        ->type_name("X");
    add_view_options(*command, o);
    command->add_option("--out", o.out, "Folder for the results")
        ->type_name("DIR")
        ->capture_default_str();
    add_device_option(*command, o.device);
    add_json_flag(*command, *json);
    command->callback(
        [command, options, json, &exit_code] { exit_code = predict(*command, *options, *json); });
}

}  // namespace vkrun
