#include "vkrun/predict/prediction.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/image_channels.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/data/view_source.h"
#include "vkrun/eval/scores.h"

namespace vkrun {
namespace {

/// Opacities below this do not show in 8 bits.
constexpr double kInvisible = 1.0 / 255;

/// The built-in weights, in the folder of the sources or in the prefix of an installed program.
std::string built_in_weights() {
    namespace fs = std::filesystem;
    std::error_code none;
    const fs::path program = fs::read_symlink("/proc/self/exe", none);
    const fs::path name = fs::path("weights") / "cars64" / "weights.safetensors";
    std::vector<fs::path> places = {program.parent_path() / ".." / "share" / "libsplat" / name};
    for (fs::path folder = program.parent_path(); folder.has_relative_path();
         folder = folder.parent_path())
        places.push_back(folder / "tools" / name);
    for (const fs::path& place : places)
        if (fs::exists(place)) return place.lexically_normal().string();
    throw Failure(kBadData, "the built-in weights are missing: name others with --weights");
}

/// The input of a prediction, and the cameras that draw its result.
struct Task {
    Views views;                ///< the input first; then, with a truth, the novel ones
    std::vector<float> truths;  ///< [n,3,R,R] of all views; empty without
    std::string name;
    Json photo;
};

/// How the picture and its maps are cut out. Points into `options`.
splat_photo_desc photo_desc(const PredictionOptions& options, const Network& network) {
    auto desc = sized<splat_photo_desc>();
    const auto path = [](const std::string& text) { return text.empty() ? nullptr : text.c_str(); };
    desc.image = path(options.image);
    desc.depth = path(options.depth);
    desc.normal = path(options.normal);
    desc.mask = path(options.mask);
    desc.resolution = network.resolution();
    desc.foreground = options.foreground;
    if (options.whole) desc.flags |= SPLAT_PHOTO_WHOLE;
    std::copy_n(network.background(), 3, desc.background);
    return desc;
}

Task read_photo(const PredictionOptions& options, const Network& network) {
    if (network.views() != 1)
        throw Failure(kUsageError, "the network takes " + std::to_string(network.views()) +
                                       " views of an object, expected 1: predict from --data");
    if (network.channels().origin_distance)
        throw Failure(
            kUsageError,
            "the network takes the distance of the object's origin "
            "(data.origin_distances), which a picture does not give: predict from --data");
    const splat_photo_desc desc = photo_desc(options, network);
    const ImageChannels& channels = network.channels();
    if (channels.depth != !options.depth.empty() || channels.normal != !options.normal.empty())
        throw Failure(kUsageError, std::string("the network takes ") +
                                       (channels.depth ? "" : "no ") + "depth and " +
                                       (channels.normal ? "" : "no ") +
                                       "normal map: give --depth and --normal to match");
    const std::size_t pixels = std::size_t{network.resolution()} * network.resolution();
    std::vector<float> image(3 * pixels), depth(pixels), normal(3 * pixels), mask(pixels);
    auto out = sized<splat_dataset_views>();
    out.images = image.data();
    out.depths = depth.data();
    out.normals = normal.data();
    out.masks = mask.data();
    char text[256];
    std::size_t needed = 0;
    if (splat_photo_read(&desc, &out, text, sizeof text, &needed) < SPLAT_OK)
        throw Failure(kBadData, splat_last_error_message());
    Task task;
    task.name = std::filesystem::path(options.image).stem().string();
    task.photo = Json::parse(text);
    task.views.images = image;
    std::vector<float>& inputs = task.views.inputs;
    inputs = image;
    if (channels.depth) inputs.insert(inputs.end(), depth.begin(), depth.end());
    if (channels.normal) inputs.insert(inputs.end(), normal.begin(), normal.end());
    if (channels.mask) inputs.insert(inputs.end(), mask.begin(), mask.end());
    task.views.view_to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    task.views.quaternions = {1, 0, 0, 0};
    task.views.cameras = {network.camera()};
    const auto focal = static_cast<float>(network.camera().fx);
    task.views.focals = {focal, focal};
    return task;
}

Task read_object(const PredictionOptions& options, const Json& config, const Network& network) {
    const ViewSource data(config, options.data, options.split);
    if (options.object >= data.objects())
        throw Failure(kUsageError,
                      format("--object is %u, but there are %u", options.object, data.objects()));
    const EvaluatedViews which =
        evaluated_views(data.views_of(options.object), network.views(), options.views);
    std::vector<std::uint32_t> numbers = which.conditioning;
    numbers.insert(numbers.end(), which.novel.begin(), which.novel.end());
    Task task;
    task.views = data.read(options.object, numbers, network.views(), network.channels());
    task.truths = task.views.images;
    task.name = data.name(options.object);
    return task;
}

/// Cameras around the middle of the visible Gaussians, at the input camera's distance.
std::vector<splat_camera> orbit(const PredictionOptions& options, const Network& network,
                                const Scene& scene) {
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    std::vector<float> means(3 * info.count);
    check(splat_scene_read(scene.get(), "means", means.data(), means.size() * sizeof(float)));
    double depth = 0;
    for (std::size_t i = 0; i < info.count; ++i)
        depth += static_cast<double>(means[3 * i + 2]) / static_cast<double>(info.count);
    auto desc = sized<splat_orbit_desc>();
    desc.width = desc.height = network.resolution();
    desc.elevation = options.elevation * std::numbers::pi / 180;
    desc.distance = depth;
    desc.fov_x = 2 * std::atan(0.5 * network.resolution() / network.camera().fx);
    std::vector<splat_camera> cameras(options.views);
    check(splat_camera_orbit(scene.get(), &desc, options.views, cameras.data()));
    return cameras;
}

/// Fit s d + t to the true depth by least squares where both are known. The truth is cut out as the
/// picture was; larger is farther.
Json compare_depth(const PredictionOptions& options, Network& network, const Scene& scene,
                   const Task& task) {
    splat_photo_desc desc = photo_desc(options, network);
    desc.depth = options.true_depth.c_str();
    const std::size_t pixels = std::size_t{network.resolution()} * network.resolution();
    std::vector<float> truth(pixels), known(pixels);
    auto out = sized<splat_dataset_views>();
    out.depths = truth.data();
    out.masks = known.data();
    if (splat_photo_read(&desc, &out, nullptr, 0, nullptr) < SPLAT_OK)
        throw Failure(kBadData, splat_last_error_message());
    const Depth drawn = network.draw_depth(scene, task.views.cameras[0]);
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < pixels; ++i) {
        if (drawn.alpha[i] < 0.5F || known[i] < 0.99F || truth[i] <= 0) continue;
        const auto x = static_cast<double>(drawn.depth[i]);
        const auto y = static_cast<double>(truth[i]);
        used.push_back(i);
        n += 1;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
        syy += y * y;
    }
    if (n < 2)
        throw Failure(kBadData,
                      format("'%s' shares %.0f pixels with the prediction, expected 2 or more",
                             options.true_depth.c_str(), n));
    const double vx = sxx - sx * sx / n, vy = syy - sy * sy / n, cov = sxy - sx * sy / n;
    const double scale = cov / vx, shift = (sy - scale * sx) / n;
    double error = 0, least = 1, most = 0;
    for (const std::size_t i : used) {
        const auto y = static_cast<double>(truth[i]);
        error += std::abs(scale * static_cast<double>(drawn.depth[i]) + shift - y) / n;
        least = std::min(least, y);
        most = std::max(most, y);
    }
    if (!(most > least))
        throw Failure(kBadData, "'" + options.true_depth + "' is constant over the object");
    return {{"pixels", used.size()},
            {"scale", scale},
            {"shift", shift},
            {"error", error / (most - least)},  // of the range of the true depth
            {"correlation", cov / std::sqrt(vx * vy)}};
}

void add_scores(const Network& network, const Task& task, const std::vector<float>& images,
                Json& result) {
    const std::uint32_t side = network.resolution();
    const std::size_t plane = std::size_t{3} * side * side;
    Scores novel, input;
    for (std::size_t i = 0; i * plane < images.size(); ++i) {
        auto scores = sized<splat_image_scores>();
        check(splat_image_compare(images.data() + i * plane, task.truths.data() + i * plane, 3,
                                  side, side, &scores));
        (i < network.views() ? input : novel).add(scores, std::numeric_limits<double>::quiet_NaN());
    }
    novel.finish();
    input.finish();
    result["psnr"] = novel.psnr;
    result["ssim"] = novel.ssim;
    result["novel_views"] = novel.views;
    result["psnr_input"] = input.psnr;
}

std::vector<float> interleaved(const float* planes, std::size_t pixels) {
    std::vector<float> rgb(3 * pixels);
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < 3; ++c) rgb[3 * i + c] = planes[c * pixels + i];
    return rgb;
}

constexpr std::uint32_t kSheetColumns = 8;
constexpr std::uint32_t kSheetWidth = 1000, kPictureWidth = 256;  ///< of the page, in its pixels

/// Input views, each next to its prediction, then novel views. With truths, a row of them stands
/// above each row of predictions.
std::vector<const float*> sheet_cells(const Task& task, const std::vector<float>& images,
                                      std::size_t inputs, std::size_t plane) {
    const std::size_t count = images.size() / plane;
    std::vector<const float*> cells;
    for (std::size_t i = 0; i < inputs; ++i) {
        cells.push_back(task.views.images.data() + plane * i);
        cells.push_back(images.data() + plane * i);
    }
    if (task.truths.empty()) {
        for (std::size_t i = inputs; i < count; ++i) cells.push_back(images.data() + plane * i);
        return cells;
    }
    const auto end_row = [&] {
        while (cells.size() % kSheetColumns != 0) cells.push_back(nullptr);
    };
    for (std::size_t first = inputs; first < count; first += kSheetColumns)
        for (const std::vector<float>* from : {&task.truths, &images}) {
            end_row();
            for (std::size_t i = first; i < std::min(first + kSheetColumns, count); ++i)
                cells.push_back(from->data() + plane * i);
        }
    return cells;
}

void write_pictures(const std::string& out, const Network& network, const Task& task,
                    const std::vector<float>& images) {
    const std::uint32_t side = network.resolution();
    const std::size_t pixels = std::size_t{side} * side;
    const std::size_t count = images.size() / (3 * pixels);
    const auto save = [&](const std::string& name, const float* planes) {
        const std::vector<float> rgb = interleaved(planes, pixels);
        check(splat_image_save((out + "/" + name).c_str(), rgb.data(), side, side, 3));
    };
    save("input.png", task.views.images.data());
    std::vector<float> frames;
    for (std::size_t i = network.views(); i < count; ++i) {
        const float* const image = images.data() + 3 * pixels * i;
        save(format("view_%02zu.png", i - network.views()), image);
        const std::vector<float> rgb = interleaved(image, pixels);
        frames.insert(frames.end(), rgb.begin(), rgb.end());
    }
    check(splat_image_save_animation((out + "/orbit.png").c_str(), frames.data(),
                                     static_cast<std::uint32_t>(frames.size() / (3 * pixels)), side,
                                     side, 3, 80));
    contact_sheet(sheet_cells(task, images, network.views(), 3 * pixels), side, kSheetColumns)
        .save(out + "/sheet.png");
}

/// The result for the page, in words and rounded.
std::vector<std::pair<std::string, std::string>> facts_of(const Json& result) {
    const auto number = [](const Json& of, const char* key) { return of.at(key).get<double>(); };
    std::vector<std::pair<std::string, std::string>> facts = {
        {"Input", result.at("input")},
        {"Weights", std::filesystem::path(result.at("weights").get<std::string>()).filename()},
        {"Gaussians", format("%.0f, and %.0f that cannot be seen were left out",
                             number(result, "gaussians"), number(result, "left_out"))},
        {"Time",
         format("%.0f ms to predict, %.0f ms to draw %.0f images", number(result, "predict_ms"),
                number(result, "draw_ms"), number(result, "images"))},
        {"Device", result.at("device")}};
    if (result.contains("photo"))
        facts.emplace_back("Object found by", result.at("photo").at("mask"));
    if (result.contains("psnr"))
        facts.emplace_back("Against the truth",
                           format("PSNR %.2f dB, SSIM %.3f on %.0f novel views; PSNR of the input "
                                  "view %.2f dB",
                                  number(result, "psnr"), number(result, "ssim"),
                                  number(result, "novel_views"), number(result, "psnr_input")));
    if (result.contains("depth"))
        facts.emplace_back(
            "Depth of the input view",
            format("correlation %.3f, mean error %.3f of its range, after scale and shift",
                   number(result.at("depth"), "correlation"), number(result.at("depth"), "error")));
    return facts;
}

std::string write_report(const std::string& out, const Task& task, const Json& result) {
    HtmlPage page("Prediction of " + task.name);
    page.picture(out + "/input.png", "input", kPictureWidth);
    page.picture(out + "/orbit.png", "novel views", kPictureWidth);
    page.heading("Facts");
    page.facts(facts_of(result));
    page.heading("Views");
    page.picture(out + "/sheet.png",
                 task.truths.empty()
                     ? "the input, its reconstruction, and novel views"
                     : "the input and its reconstruction; then alternately a row of "
                       "true and a row of predicted novel views",
                 kSheetWidth);
    const std::string path = out + "/report.html";
    replace_file(path, page.text());
    return path;
}

}  // namespace

Json run_prediction(const PredictionOptions& options) {
    const std::string file = options.weights.empty() ? built_in_weights() : options.weights;
    const Json config = merged_config(config_beside(file, options.config), {});
    const Device device = open_device(device_desc(options.device));
    Network network(device.get(), config);
    network.load(file);
    const Task task =
        options.data.empty() ? read_photo(options, network) : read_object(options, config, network);
    make_folder(options.out);

    const Stopwatch predicting;
    const Scene scene = network.predict(task.views);
    const double predict_ms = predicting.ms();
    const std::uint32_t before = network.views() * network.resolution() * network.resolution();
    check(splat_scene_filter(scene.get(), SPLAT_FILTER_FINITE, kInvisible));
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    if (info.count == 0)
        throw Failure(kFailed, "the network predicted nothing that can be seen for '" + task.name +
                                   "': is it trained?");
    check(splat_scene_save(scene.get(), (options.out + "/scene.ply").c_str(), nullptr));

    std::vector<splat_camera> cameras = task.views.cameras;
    if (task.truths.empty()) {
        const auto around = orbit(options, network, scene);
        cameras.insert(cameras.end(), around.begin(), around.end());
    }
    const Stopwatch drawing;
    const std::vector<float> images = network.draw(scene, cameras);
    Json result = {{"input", task.name},       {"weights", file},
                   {"gaussians", info.count},  {"left_out", before - info.count},
                   {"images", cameras.size()}, {"predict_ms", predict_ms},
                   {"draw_ms", drawing.ms()},  {"device", info_of(device.get()).name}};
    if (!task.photo.is_null()) result["photo"] = task.photo;
    if (!task.truths.empty()) add_scores(network, task, images, result);
    if (!options.true_depth.empty()) result["depth"] = compare_depth(options, network, scene, task);
    write_pictures(options.out, network, task, images);
    result["report"] = write_report(options.out, task, result);
    return result;
}

}  // namespace vkrun
