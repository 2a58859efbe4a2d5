// vkrun demo: what the built-in weights do, in one page.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <numeric>
#include <vector>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/data/for_each_index.h"
#include "vkrun/data/open_data.h"
#include "vkrun/eval/scoring.h"
#include "vkrun/predict/network.h"
#include "vkrun/predict/prediction.h"
#include "vkrun/weights/builtin_weights.h"

namespace vkrun {
namespace {

constexpr const char* kDemoFooter =
    R"(Makes procedural objects that the weights were not trained on, and predicts each from one image: cars; chairs,
without and with the low-rank adapters for chairs; the cars with their depth and normals as further inputs. What
adapters and maps gain is judged in pairs, on all --objects; the page shows the object in the middle by PSNR.

OUT gets report.html, in which the scenes turn, beside their true images, and the files of 'vkrun predict' in car/,
chair/ and car_depth_normal/, those of 'vkrun eval' in cars/, chairs_without/, chairs/ and cars_depth_normal/, the data
set in data/.

Exit status: 0 done, 1 failed, 2 wrong usage, 3 no device, 4 the built-in weights are missing.

Examples:
  vkrun demo
  vkrun demo --out look --objects 32
)";

struct DemoOptions {
    std::string out = "out";
    std::uint32_t objects = 8;
    std::string device = "best";
    bool json = false;
};

constexpr std::uint32_t kNovelViews = 24;  ///< novel ones of an object

/// Write the test objects. Returns the folder of their data set.
std::string make_objects(const DemoOptions& options, const char* category) {
    const std::string root = options.out + "/data";
    auto desc = sized<splat_synthetic_desc>();
    desc.path = root.c_str();
    desc.category = category;
    desc.seed = 1;  // seed of the training objects, which are another split
    desc.resolution = 64;
    desc.test_views = 251;
    desc.test_objects = options.objects;
    for_each_index(category, options.objects, 0,
                   [&desc](std::uint32_t index) { check(splat_synthetic_write(&desc, index)); });
    return root + "/srn_" + category;
}

/// A network on the objects of a data set.
struct Method {
    const Network& network;
    std::string data;
    const char* folder;  ///< below OUT
};

/// PSNR of the novel views of every object; the files of 'vkrun eval' in the folder.
std::vector<double> score(const DemoOptions& options, const Method& method) {
    const Dataset dataset = open_data(method.network.files.config, method.data, "test");
    auto desc = sized<splat_evaluator_desc>();
    desc.predictor = method.network.predictor.get();
    desc.dataset = dataset.get();
    desc.novel_views = kNovelViews;
    desc.objects = options.objects;
    Evaluator evaluator;
    check(splat_evaluator_create(&desc, evaluator.out()), kBadData);
    const ScoredObjects scored = score_objects(
        evaluator.get(), method.folder, Shard(),
        [&](std::uint32_t object) { return score_by_network(evaluator.get(), object); });
    const std::string out = options.out + "/" + method.folder;
    make_folder(out);
    check(splat_evaluator_save(evaluator.get(), out.c_str()));
    check_finite(scored);
    std::vector<double> psnr;
    for (const ObjectRow& row : scored.rows) psnr.push_back(row.psnr);
    return psnr;
}

/// The object in the middle by PSNR.
std::uint32_t middle(const std::vector<double>& psnr) {
    std::vector<std::uint32_t> order(psnr.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return psnr[a] < psnr[b]; });
    return order[order.size() / 2];
}

/// PSNR of the novel views, B against A.
splat_metric_comparison compare(const DemoOptions& options, const Method& a, const Method& b) {
    const std::string path_a = options.out + "/" + a.folder, path_b = options.out + "/" + b.folder;
    auto desc = sized<splat_compare_desc>();
    desc.a.path = path_a.c_str();
    desc.b.path = path_b.c_str();
    Comparison comparison;
    check(splat_compare_scores(&desc, comparison.out()));
    const Json report = library_json(splat_comparison_report, comparison.get());
    const Json& metrics = report.at("metrics");
    for (std::uint32_t i = 0; i < metrics.size(); ++i) {
        if (metrics.at(i).at("metric") != "psnr") continue;
        auto found = sized<splat_metric_comparison>();
        check(splat_comparison_metric(comparison.get(), i, &found));
        return found;
    }
    throw Failure(kFailed, "the objects have no PSNR: drawn views equal their targets everywhere");
}

/// Predict one object, and add its scene to the page.
Json predict(const DemoOptions& options, splat_device device, const Method& method,
             const char* folder, std::uint32_t object, HtmlPage& page) {
    PredictionOptions prediction;
    prediction.data = method.data;
    prediction.object = object;
    prediction.views = kNovelViews;
    prediction.out = options.out + "/" + folder;
    return run_prediction(prediction, device, method.network, &page);
}

std::string scores_text(const Json& result) {
    return format("PSNR %.2f dB and SSIM %.3f on %u novel views, %.2f dB in the view of the input",
                  result.at("psnr").get<double>(), result.at("ssim").get<double>(),
                  result.at("novel_views").get<unsigned>(), result.at("psnr_input").get<double>());
}

std::string gain_text(const splat_metric_comparison& gain) {
    return format("%.2f -> %.2f dB, %+.2f [%+.2f, %+.2f]", gain.mean_a, gain.mean_b,
                  gain.difference, gain.low, gain.high);
}

Json gain_json(const splat_metric_comparison& gain) {
    return {{"psnr_without", gain.mean_a},
            {"psnr_with", gain.mean_b},
            {"difference", gain.difference},
            {"low", gain.low},
            {"high", gain.high}};
}

int demo(const DemoOptions& options) {
    const Device opened = open_device(device_desc(options.device));
    const splat_device device = opened.get();
    const std::string plain_file = weights_named(kPlainWeights);
    const Weights plain_weights = load_weights(plain_file);
    const Network plain_network =
        load_network(device, network_files(plain_file, "", ""), plain_weights.get());
    const Network chair_network =
        load_network(device, network_files(plain_file, "", "chairs"), plain_weights.get());
    const Network map_network =
        load_network(device, network_files(weights_named(kDepthNormalWeights), "", ""));
    make_folder(options.out);
    const std::string cars = make_objects(options, "cars");
    const std::string chairs = make_objects(options, "chairs");
    const Method plain{plain_network, cars, "cars"};
    const Method maps{map_network, cars, "cars_depth_normal"};
    const Method without{plain_network, chairs, "chairs_without"};
    const Method adapted{chair_network, chairs, "chairs"};
    const std::uint32_t shown_car = middle(score(options, plain));
    score(options, maps);
    score(options, without);
    const std::uint32_t shown_chair = middle(score(options, adapted));
    const splat_metric_comparison map_gain = compare(options, plain, maps);
    const splat_metric_comparison adapter_gain = compare(options, without, adapted);

    HtmlPage page("One picture in, a scene out");
    page.paragraph(format(
        "Each scene was predicted from one picture of 64 x 64 pixels by the weights that come with "
        "libsplat, which were trained on procedural cars and saw none of these objects. What the "
        "picture does not show is a guess. Of %u cars and %u chairs the page shows those in the "
        "middle by PSNR of novel views.",
        options.objects, options.objects));
    page.heading("A car");
    const Json car = predict(options, device, plain, "car", shown_car, page);
    page.paragraph(scores_text(car) +
                   format("; over all cars %.2f dB. The network took %.0f ms on %s.",
                          map_gain.mean_a, car.at("predict_ms").get<double>(),
                          car.at("device").get<std::string>().c_str()));
    page.heading("A chair, through adapters");
    const Json chair = predict(options, device, adapted, "chair", shown_chair, page);
    page.paragraph(
        "The same weights with low-rank adapters that were trained on chairs: " +
        scores_text(chair) +
        ". All chairs, without and with adapters, and the 95 % interval of the difference: " +
        gain_text(adapter_gain) + ".");
    page.heading("The car, with depth and normals");
    const Json mapped = predict(options, device, maps, "car_depth_normal", shown_car, page);
    page.paragraph(
        "Weights that also take the depth and the normals of the picture: " + scores_text(mapped) +
        ". All cars, without and with maps: " + gain_text(map_gain) + ".");

    const std::string path = options.out + "/report.html";
    replace_file(path, page.text());
    if (options.json) {
        print_json({{"objects", options.objects},
                    {"car", car},
                    {"chair", chair},
                    {"car_depth_normal", mapped},
                    {"adapters", gain_json(adapter_gain)},
                    {"depth_normal", gain_json(map_gain)},
                    {"report", path}});
        return kSuccess;
    }
    std::printf("car %u: %s\nchair %u: %s\ncar %u with depth and normals: %s\n", shown_car,
                scores_text(car).c_str(), shown_chair, scores_text(chair).c_str(), shown_car,
                scores_text(mapped).c_str());
    std::printf(
        "%u chairs, without and with adapters: %s\n%u cars, without and with maps: %s\n%s\n",
        options.objects, gain_text(adapter_gain).c_str(), options.objects,
        gain_text(map_gain).c_str(), path.c_str());
    return kSuccess;
}

}  // namespace

void add_demo(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "demo", "Show in one page what the built-in weights do.", kDemoFooter);
    auto options = std::make_shared<DemoOptions>();
    command->add_option("--out", options->out, "Folder for the results")
        ->type_name("DIR")
        ->capture_default_str();
    add_count_option(*command, "--objects", options->objects, "Cars, and chairs, to judge by", 2,
                     1000);
    add_device_option(*command, options->device);
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = demo(*options); });
}

}  // namespace vkrun
