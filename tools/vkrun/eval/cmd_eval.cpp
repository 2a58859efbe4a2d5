// vkrun eval: predict the objects of a data set and compare with their images.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/path_name.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/shard.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/data/open_data.h"
#include "vkrun/eval/baseline.h"
#include "vkrun/eval/eval_report.h"
#include "vkrun/eval/object_views.h"
#include "vkrun/eval/scene_eval.h"
#include "vkrun/eval/scoring.h"
#include "vkrun/eval/shard_merge.h"
#include "vkrun/predict/drawing.h"
#include "vkrun/predict/network.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/weights/builtin_weights.h"

namespace vkrun {
namespace {

constexpr const char* kEvalFooter =
    R"(Each object is predicted from its conditioning views and drawn in all its views. Conditioning views are
number 64 (for two inputs also 128) of SRN's 251 test views, 0 (and 30) of CO3D's, that of data.views_file for
NMR's, else the first ones; --inputs names others, such as 64,80,96,112 for four sides of 'data synth' cars. PSNR and
SSIM are means over an object's views, then over objects, separately for conditioning and novel views. A view that
equals its target has no PSNR; such views are counted. A view whose target is all black is skipped.

LPIPS needs the weights of its network, which are not part of libsplat: pass --lpips twice, with a file of
torchvision's vgg16 and with lpips/weights/v0.1/vgg.pth of the lpips package. Without them LPIPS is nan.

OUT gets results.json, per_object.csv, per_image.csv (each novel view), objects.json (all numbers of each object, which
shards are merged from), scores.txt ("index_name psnr ssim lpips" of novel views, as Splatter Image writes it) and
report.html, in which the worst, the median and the best object turn; with --images N contact sheets of the first N
objects, target above prediction, and with --single N each of their views as NNNN_NAME/VVV_drawn.png and VVV_true.png.

--baseline scores a simple method in place of the network, for 'vkrun compare': "mean" shows the mean of all
training images for every object; "billboard" shows the first conditioning view as a flat picture, at the depth
(data.znear to data.zfar, 16 steps) that fits the novel views of that object best.

--shard 0/4 to 3/4, on machines that share OUT, score a part of the objects each, into OUT/shard_I_of_4. The last to
end merges them by the objects' names into the files that one machine would have written. docs/shards.md shows
them with GNU parallel and as a Slurm array. Shards with other options do not merge: OUT is then a new folder.

A scene, of 'vkrun fit' or another program, is scored on the photographs that 'vkrun fit' holds out of --data, as that
scores itself: PSNR and SSIM over the pixels that the lens and the mask leave, the drawn image cut to 0 to 1; and over
the central part of the pictures alone (--border). OUT gets results.json, per_view.csv, which 'vkrun compare' reads,
and report.html.

Exit status: 0 done, 1 failed, 2 wrong usage or configuration, 3 no device, 4 bad data, 7 the network's output
is not finite: such objects have no scores (null, nan), and there is no mean; results.json counts what is not
finite, and the images in which nothing is drawn.

Examples:
  vkrun eval run/weights_best.safetensors --data cars --out eval
  vkrun eval run/weights_best.safetensors --data cars --out flat --baseline billboard
  vkrun compare eval/per_object.csv flat/per_object.csv
  vkrun eval run/scene.ply --data photos --downscale 2 --out scores
  vkrun eval model_best.pth --config config.yaml --data srn_cars --split test --out eval --images 4
)";

struct EvalOptions {
    SceneEvalOptions scene;
    std::string weights, config, adapters, data, split = "test", out, baseline;
    std::vector<std::string> changes, lpips;
    std::vector<std::uint32_t> inputs;  ///< numbers of the conditioning views
    std::string shard;
    std::uint32_t objects = 0, views = 0, images = 0, single = 0;
    std::string device = "best";
    bool allow_missing = false;
    bool json = false;
};

/// Where files of an object go: OUT/0003_name.
std::string object_path(const EvalOptions& options, std::uint32_t index, const PathName& name) {
    return options.out + format("/%04u_", index) + name.text();
}

/// Each view of an object as it was drawn and as it is, named by its number in the data set.
void save_views(const std::string& folder, const ObjectViews& views,
                const std::vector<float>& images) {
    make_folder(folder);
    const std::size_t plane = std::size_t{3} * views.side * views.side;
    for (std::size_t i = 0; i < views.numbers.size(); ++i)
        for (const auto& [kind, from] : {std::pair{"drawn", &images}, {"true", &views.images}}) {
            const std::string path = folder + format("/%03u_%s.png", views.numbers[i], kind);
            const splat_image image = planar_image(from->data() + i * plane, views.side, 3);
            check(splat_image_save(path.c_str(), &image));
        }
}

/// Empty without files.
Lpips make_lpips(splat_device device, const std::vector<std::string>& files, std::uint32_t side) {
    Lpips lpips;
    if (files.empty()) return lpips;
    std::vector<Weights> weights(files.size());
    std::vector<splat_weights> handles;
    const auto good = [](splat_result result) {
        if (result < SPLAT_OK)
            throw Failure(kBadData, std::string("--lpips: ") + library_message());
    };
    for (std::size_t i = 0; i < files.size(); ++i) {
        good(splat_weights_load(files[i].c_str(), 0, weights[i].out()));
        handles.push_back(weights[i].get());
    }
    auto desc = sized<splat_lpips_desc>();
    desc.weights = handles.data();
    desc.weight_count = static_cast<std::uint32_t>(handles.size());
    desc.side = side;
    good(splat_lpips_create(device, &desc, lpips.out()));
    return lpips;
}

Evaluator make_evaluator(const EvalOptions& options, splat_predictor predictor,
                         splat_dataset dataset, splat_lpips lpips) {
    auto desc = sized<splat_evaluator_desc>();
    desc.predictor = predictor;
    desc.dataset = dataset;
    desc.method = options.baseline.empty() ? nullptr : options.baseline.c_str();
    desc.lpips = lpips;
    desc.conditioning = options.inputs.data();
    desc.conditioning_count = options.inputs.size();
    desc.novel_views = options.views;
    desc.objects = options.objects;
    Evaluator evaluator;
    check(splat_evaluator_create(&desc, evaluator.out()), kBadData);
    return evaluator;
}

/// What an evaluation works with. A baseline takes the place of the network.
struct Methods {
    Device device;
    Dataset dataset;
    Network network;
    std::unique_ptr<Baseline> baseline;
    Lpips lpips;
    Evaluator evaluator;
};

/// Score one object, and save its images.
splat_object_scores score_object(const EvalOptions& options, const Methods& methods,
                                 std::uint32_t index) {
    const splat_evaluator evaluator = methods.evaluator.get();
    const bool saved = index < std::max(options.images, options.single);
    const ObjectViews views = read_views(evaluator, index, methods.baseline != nullptr || saved);
    auto scores = sized<splat_object_scores>();
    std::vector<float> images;
    if (methods.baseline != nullptr) {
        images = methods.baseline->draw(views);
        check(
            splat_evaluator_score_images(evaluator, index, images.data(), images.size(), &scores));
    } else {
        scores = score_by_network(evaluator, index);
        if (saved) images = drawn_images(evaluator, index, views);
    }
    const std::string path = object_path(options, index, PathName(scores.name));
    if (index < options.images) save_eval_sheet(path + ".png", views, images);
    if (index < options.single) save_views(path, views, images);
    return scores;
}

std::string write_eval_page(const EvalOptions& options, const Methods& methods, const Json& results,
                            std::vector<ObjectRow> rows) {
    const Network& network = methods.network;
    const auto show = [&](std::uint32_t object) {
        ShownObject shown{read_views(methods.evaluator.get(), object, true), {}, {}};
        const ObjectViews& views = shown.views;
        if (methods.baseline != nullptr) {
            shown.images = methods.baseline->draw(views);
            return shown;
        }
        check(splat_predictor_predict_object(
            network.predictor.get(), methods.dataset.get(), object, views.numbers.data(),
            static_cast<std::uint32_t>(views.numbers.size()), shown.scene.out(), nullptr));
        shown.images =
            draw_scene(methods.device.get(), shown.scene, views.cameras, network.info.background);
        return shown;
    };
    const bool baseline = !options.baseline.empty();
    const std::string& adapters = network.files.adapters;
    const std::vector<std::pair<std::string, std::string>> facts = {
        {baseline ? "Baseline" : "Weights",
         baseline ? options.baseline : weights_title(network.files.weights)},
        {"Adapters", adapters.empty() ? "none" : adapters},
        {"Data", options.data + ", split " + options.split},
        {"Objects", std::to_string(rows.size())},
        {"Device", info_of(methods.device.get()).name}};
    return write_eval_report(options.out, results, facts, std::move(rows), network.info.background,
                             show);
}

void print_table(const EvalOptions& options, std::uint32_t count, const Json& json,
                 const std::string& page) {
    const auto number = [](const Json& value, const char* pattern) {
        return value.is_null() ? "nan" : format(pattern, value.get<double>());
    };
    Table table({"views", ">PSNR", ">SSIM", ">LPIPS", ">count", ">perfect"});
    for (const char* kind : {"novel", "conditioning"}) {
        const Json& s = json.at(kind);
        table.add({kind, number(s.at("psnr"), "%.3f"), number(s.at("ssim"), "%.4f"),
                   options.lpips.empty() ? "no weights" : number(s.at("lpips"), "%.4f"),
                   std::to_string(s.at("views").get<std::uint32_t>()),
                   std::to_string(s.at("perfect_views").get<std::uint32_t>())});
    }
    std::printf("%u objects of '%s', split %s\n%s", count, options.data.c_str(),
                options.split.c_str(), table.text().c_str());
    if (options.baseline.empty())
        std::printf("%.2f predictions and %.1f images a second\n",
                    json.at("predictions_per_second").get<double>(),
                    json.at("images_per_second").get<double>());
    if (!page.empty()) std::printf("%s\n", page.c_str());
}

/// What shards must share besides what splat_evaluator_load() compares.
Json shared_settings(const EvalOptions& options, const NetworkFiles& files) {
    return {{"--adapters", files.adapters}, {"--config", options.config},
            {"--set", options.changes},     {"--lpips", options.lpips},
            {"--objects", options.objects}, {"--views", options.views},
            {"--inputs", options.inputs}};
}

/// Throws a usage Failure for an option that has no effect.
void check_kind(const CLI::App& command, bool scene) {
    const char* const of_scenes[] = {"--test-every", "--downscale", "--cameras",
                                     "--masks",      "--border",    "--white-background"};
    const char* const of_networks[] = {"--split",   "--config", "--adapters", "--set",
                                       "--views",   "--images", "--single",   "--lpips",
                                       "--objects", "--shard",  "--baseline", "--allow-missing",
                                       "--inputs"};
    for (const char* const name : scene ? std::span<const char* const>(of_networks) : of_scenes)
        if (command.get_option(name)->count() > 0)
            throw Failure(kUsageError,
                          std::string(name) + (scene ? " is for a network, not a scene"
                                                     : " is for a scene, not a network"));
}

int evaluate(const CLI::App& command, const EvalOptions& options) {
    const bool scene = named_format(options.weights) != nullptr;
    check_kind(command, scene);
    if (scene) {
        check_no_run(options.out, "eval");
        return evaluate_scene(options.weights, options.data, options.out, options.scene,
                              options.device, options.json);
    }
    if (!options.adapters.empty() && !options.baseline.empty())
        throw Failure(kUsageError, "--adapters has no effect with --baseline: leave one out");
    check_no_run(options.out, "eval");
    const Shard shard = parse_shard(options.shard);
    // Not what the training allowed.
    std::vector<std::string> changes = {
        format("data.allow_missing=%s", options.allow_missing ? "true" : "false")};
    changes.insert(changes.end(), options.changes.begin(), options.changes.end());
    const NetworkFiles files =
        network_files(weights_named(options.weights), options.config, options.adapters, changes);
    Methods methods;
    methods.dataset = open_data(files.config, options.data, options.split);
    methods.device = open_device(device_desc(options.device));
    const splat_device device = methods.device.get();
    methods.network = load_network(device, files);
    const std::size_t given = options.inputs.size();
    if (given > 0 && given != methods.network.info.views)
        throw Failure(kUsageError,
                      format("--inputs names %zu views, expected the %u that the network takes",
                             given, methods.network.info.views));
    methods.lpips =
        make_lpips(device, options.lpips, files.config.at("data").at("training_resolution"));
    methods.evaluator = make_evaluator(options, methods.network.predictor.get(),
                                       methods.dataset.get(), methods.lpips.get());
    methods.baseline = make_baseline(options.baseline, device, files.config, options.data);
    const splat_evaluator evaluator = methods.evaluator.get();
    make_folder(options.out);
    const ScoredObjects scored =
        score_objects(evaluator, "evaluating", shard,
                      [&](std::uint32_t object) { return score_object(options, methods, object); });
    const bool merged =
        shard.count == 1 ||
        merge_shards(options.out, shard, shared_settings(options, files), evaluator);
    if (merged) check(splat_evaluator_save(evaluator, options.out.c_str()));
    const Json json = library_json(splat_evaluator_report, evaluator);
    const std::string page =
        merged ? write_eval_page(options, methods, json, saved_rows(options.out)) : "";
    if (options.json)
        print_json(json);
    else
        print_table(options, json.at("objects"), json, page);
    check_finite(scored);
    return kSuccess;
}

}  // namespace

void add_eval(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "eval", "Score a network, or a scene on photographs.", kEvalFooter);
    auto options = std::make_shared<EvalOptions>();
    command
        ->add_option("WEIGHTS", options->weights,
                     "Weights of the network: .safetensors, .pth or .npz, or the name of built-in\n"
                     "ones: cars64; or a file of a scene, such as .ply")
        ->required()
        ->type_name("");
    command
        ->add_option("--data", options->data, "Folder of the data set, or of a scene's photographs")
        ->required()
        ->type_name("DIR");
    command->add_option("--split", options->split, "train, val or test")
        ->type_name("NAME")
        ->capture_default_str();
    command->add_option("--out", options->out, "Folder for the results")
        ->required()
        ->type_name("DIR");
    add_network_options(*command, options->config, options->adapters);
    add_changes_option(*command, options->changes);
    add_allow_missing_flag(*command, options->allow_missing);
    command->add_option("--objects", options->objects, "Only the first N objects; default: all")
        ->type_name("N");
    command
        ->add_option("--views", options->views,
                     "Only N novel views of each object, evenly spread; default: all")
        ->type_name("N");
    command
        ->add_option("--inputs", options->inputs,
                     "Numbers of the conditioning views of each object, as many as the network\n"
                     "takes; default: see below")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->type_name("LIST");
    command
        ->add_option("--images", options->images,
                     "Write contact sheets of the first N objects; default: none")
        ->type_name("N");
    command
        ->add_option("--single", options->single,
                     "Write each view of the first N objects, drawn and true; default: none")
        ->type_name("N");
    command->add_option("--lpips", options->lpips, "Weights for LPIPS, see below; may be repeated")
        ->type_name("FILE")
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false);
    command
        ->add_option("--baseline", options->baseline,
                     "Score a baseline instead of the network: mean or billboard")
        ->type_name("NAME")
        ->check(one_of({"mean", "billboard"}));
    add_shard_option(*command, options->shard, "the objects");
    add_device_option(*command, options->device);
    add_json_flag(*command, options->json);
    add_scene_eval_options(*command, options->scene);
    command->callback([command, options, &exit_code] { exit_code = evaluate(*command, *options); });
}

}  // namespace vkrun
