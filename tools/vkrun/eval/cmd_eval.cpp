// vkrun eval: predict the objects of a data set and compare with their images.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/data/view_source.h"
#include "vkrun/eval/baseline.h"
#include "vkrun/eval/scores.h"

namespace vkrun {
namespace {

constexpr const char* kEvalFooter =
    R"(Each object is predicted from its conditioning views and drawn in all its views. Conditioning views are
number 64 (for two inputs also 128) of SRN's 251 test views, else the first ones. PSNR and SSIM are means over
an object's views, then over objects, separately for conditioning and novel views. A view that equals its
target has no PSNR; such views are counted. A view whose target is all black is skipped.

LPIPS needs the weights of its network, which are not part of libsplat: pass --lpips twice, with a file of
torchvision's vgg16 and with lpips/weights/v0.1/vgg.pth of the lpips package. Without them LPIPS is nan.

OUT gets results.json, per_object.csv, scores.txt ("index_name psnr ssim lpips" of novel views, as Splatter
Image writes it) and, with --images N, contact sheets of the first N objects: target above prediction.

--baseline scores a simple method in place of the network, for 'vkrun compare': "mean" shows the mean of all
training images for every object; "billboard" shows the first conditioning view as a flat picture, at the depth
(data.znear to data.zfar, 16 steps) that fits the novel views of that object best.

Exit status: 0 done, 1 failed, 2 wrong usage or configuration, 3 no device, 4 bad data.

Examples:
  vkrun eval run/weights_best.safetensors --data cars --out eval
  vkrun eval run/weights_best.safetensors --data cars --out flat --baseline billboard
  vkrun compare eval/per_object.csv flat/per_object.csv
  vkrun eval model_best.pth --config config.yaml --data srn_cars --split test --out eval --images 4
)";

struct EvalOptions {
    std::string weights, config, data, split = "test", out, baseline;
    std::vector<std::string> changes, lpips;
    std::uint32_t objects = 0, views = 0, images = 0;
    std::string device = "best";
    bool json = false;
};

Json scores_json(const Scores& scores) {
    return {{"psnr", scores.psnr},
            {"ssim", scores.ssim},
            {"lpips", std::isnan(scores.lpips) ? Json() : Json(scores.lpips)},
            {"views", scores.views},
            {"perfect_views", scores.perfect}};
}

void save_sheet(const EvalOptions& options, const ObjectScores& scores, std::uint32_t index,
                std::uint32_t side, const std::vector<float>& images,
                const std::vector<float>& truths) {
    constexpr std::size_t kColumns = 8;
    const std::size_t plane = std::size_t{3} * side * side;
    const std::size_t count = images.size() / plane;
    const std::size_t columns = std::min(kColumns, count);
    std::vector<const float*> cells;
    for (const std::vector<float>* from : {&truths, &images})
        for (std::size_t i = 0; i < columns; ++i)
            cells.push_back(from->data() + i * count / columns * plane);
    contact_sheet(cells, side, static_cast<std::uint32_t>(columns))
        .save(options.out + format("/%04u_", index) + scores.name + ".png");
}

void write_tables(const EvalOptions& options, const std::vector<ObjectScores>& objects) {
    std::string csv =
        "object,psnr_novel,ssim_novel,lpips_novel,psnr_cond,ssim_cond,lpips_cond,views,"
        "perfect_views,predict_ms,draw_ms\n";
    std::string text;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const ObjectScores& o = objects[i];
        csv +=
            format("%s,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%u,%u,%.3f,%.3f\n", o.name.c_str(),
                   o.novel.psnr, o.novel.ssim, o.novel.lpips, o.conditioning.psnr,
                   o.conditioning.ssim, o.conditioning.lpips, o.novel.views + o.conditioning.views,
                   o.novel.perfect + o.conditioning.perfect, 1e3 * o.predict_seconds,
                   1e3 * o.draw_seconds);
        text += format("%zu_%s %.17g %.17g %.17g\n", i, o.name.c_str(), o.novel.psnr, o.novel.ssim,
                       o.novel.lpips);
    }
    replace_file(options.out + "/per_object.csv", csv);
    replace_file(options.out + "/scores.txt", text);
}

/// Null for a baseline, which is not timed.
Json rate(double count, double seconds) {
    return seconds > 0 ? Json(count / seconds) : Json();
}

Json results(const EvalOptions& options, const ViewSource& data, const splat_device_info& device,
             const std::vector<ObjectScores>& objects) {
    double predict = 0, draw = 0;
    std::uint64_t drawn = 0;
    std::uint32_t empty = 0;
    for (const ObjectScores& object : objects) {
        predict += object.predict_seconds;
        draw += object.draw_seconds;
        drawn += object.drawn;
        empty += object.empty;
    }
    return {{"schema", 1},
            {"weights", options.baseline.empty() ? Json(options.weights) : Json()},
            {"baseline", options.baseline.empty() ? Json() : Json(options.baseline)},
            {"split", options.split},
            {"data", {{"format", data.report().at("format")}, {"objects", data.objects()}}},
            {"device", device.name},
            {"objects", objects.size()},
            {"novel", scores_json(mean_of(objects, &ObjectScores::novel))},
            {"conditioning", scores_json(mean_of(objects, &ObjectScores::conditioning))},
            {"empty_views", empty},
            {"predictions_per_second", rate(static_cast<double>(objects.size()), predict)},
            {"images_per_second", rate(static_cast<double>(drawn), draw)}};
}

/// Empty without files.
Lpips make_lpips(splat_device device, const std::vector<std::string>& files, std::uint32_t side) {
    Lpips lpips;
    if (files.empty()) return lpips;
    std::vector<Weights> weights(files.size());
    std::vector<splat_weights> handles;
    const auto good = [](splat_result result) {
        if (result < SPLAT_OK)
            throw Failure(kBadData, std::string("--lpips: ") + splat_last_error_message());
    };
    for (std::size_t i = 0; i < files.size(); ++i) {
        good(splat_weights_load(files[i].c_str(), weights[i].out()));
        handles.push_back(weights[i].get());
    }
    auto desc = sized<splat_lpips_desc>();
    desc.weights = handles.data();
    desc.weight_count = static_cast<std::uint32_t>(handles.size());
    desc.side = side;
    good(splat_lpips_create(device, &desc, lpips.out()));
    return lpips;
}

int evaluate(const EvalOptions& options) {
    const Json config =
        merged_config(config_beside(options.weights, options.config), options.changes);
    const ViewSource data(config, options.data, options.split);
    const Device device = open_device(device_desc(options.device));
    Network network(device.get(), config);
    network.load(options.weights);
    const std::uint32_t count =
        options.objects == 0 ? data.objects() : std::min(options.objects, data.objects());
    const Lpips lpips = make_lpips(device.get(), options.lpips, network.resolution());
    const std::unique_ptr<Predictor> predictor =
        options.baseline.empty() ? std::make_unique<NetworkPredictor>(network)
                                 : make_baseline(options.baseline, network, config, options.data);
    make_folder(options.out);
    Progress progress("evaluating", count);
    std::vector<ObjectScores> objects;
    for (std::uint32_t i = 0; i < count; ++i) {
        progress.show(i);
        std::vector<float> images, truths;
        objects.push_back(
            score_object(*predictor, network.channels(), data, i,
                         evaluated_views(data.views_of(i), network.views(), options.views),
                         lpips.get(), &images, &truths));
        if (i < options.images)
            save_sheet(options, objects.back(), i, network.resolution(), images, truths);
    }
    progress.show(count);
    write_tables(options, objects);
    const Json json = results(options, data, info_of(device.get()), objects);
    replace_file(options.out + "/results.json", json_text(json) + "\n");
    if (options.json) {
        print_json(json);
        return kSuccess;
    }
    Table table({"views", ">PSNR", ">SSIM", ">LPIPS", ">count", ">perfect"});
    for (const char* kind : {"novel", "conditioning"}) {
        const Json& s = json.at(kind);
        table.add(
            {kind, format("%.3f", s.at("psnr").get<double>()),
             format("%.4f", s.at("ssim").get<double>()),
             s.at("lpips").is_null() ? "no weights" : format("%.4f", s.at("lpips").get<double>()),
             std::to_string(s.at("views").get<std::uint32_t>()),
             std::to_string(s.at("perfect_views").get<std::uint32_t>())});
    }
    std::printf("%u objects of '%s', split %s\n%s", count, options.data.c_str(),
                options.split.c_str(), table.text().c_str());
    if (options.baseline.empty())
        std::printf("%.2f predictions and %.1f images a second\n",
                    json.at("predictions_per_second").get<double>(),
                    json.at("images_per_second").get<double>());
    return kSuccess;
}

}  // namespace

void add_eval(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "eval", "Score a network on a data set.", kEvalFooter);
    auto options = std::make_shared<EvalOptions>();
    command
        ->add_option("WEIGHTS", options->weights,
                     "Weights of the network: .safetensors, .pth or .npz")
        ->required()
        ->type_name("");
    command->add_option("--data", options->data, "Folder of the data set")
        ->required()
        ->type_name("DIR");
    command->add_option("--split", options->split, "train, val or test")
        ->type_name("NAME")
        ->capture_default_str();
    command->add_option("--out", options->out, "Folder for the results")
        ->required()
        ->type_name("DIR");
    command
        ->add_option("--config", options->config,
                     "Configuration of the network; default: config.json or config.yaml\n"
                     "in the folder of WEIGHTS")
        ->type_name("FILE");
    add_changes_option(*command, options->changes);
    command->add_option("--objects", options->objects, "Only the first N objects; default: all")
        ->type_name("N");
    command
        ->add_option("--views", options->views,
                     "Only N novel views of each object, evenly spread; default: all")
        ->type_name("N");
    command
        ->add_option("--images", options->images,
                     "Write contact sheets of the first N objects; default: none")
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
        ->check(CLI::IsMember({"mean", "billboard"}).description(""));
    add_device_option(*command, options->device);
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = evaluate(*options); });
}

}  // namespace vkrun
