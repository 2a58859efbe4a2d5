#include "vkrun/predict/prediction.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "core/os/path.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"
#include "vkrun/data/open_data.h"
#include "vkrun/eval/object_views.h"
#include "vkrun/predict/drawing.h"
#include "vkrun/predict/geometry.h"
#include "vkrun/predict/network_mask.h"
#include "vkrun/predict/predicted_scene.h"
#include "vkrun/predict/prediction_report.h"
#include "vkrun/priors/map_maker.h"
#include "vkrun/weights/builtin_weights.h"

namespace vkrun {
namespace {

/// A library call that blames the data for its errors.
void check_data(splat_result result) {
    if (result >= SPLAT_OK) return;
    if (result == SPLAT_ERROR_INVALID_STATE) throw Failure(kNotFinite, library_message());
    throw Failure(kBadData, library_message());
}

/// Points into `options`.
splat_picture picture_of(const PredictionOptions& options, std::size_t number = 0) {
    splat_picture picture{};
    const auto path = [](const std::string& text) { return text.empty() ? nullptr : text.c_str(); };
    picture.image.path = path(options.images[number]);
    picture.depth.path = path(options.depth);
    picture.normal.path = path(options.normal);
    picture.mask.path = path(options.mask);
    picture.foreground = options.foreground.value_or(0.0F);
    picture.focal = options.focal.value_or(0);
    picture.origin_distance = options.origin_distance.value_or(0);
    if (options.whole) picture.flags |= SPLAT_PICTURE_WHOLE;
    return picture;
}

/// What splat_prediction is given to fill, for `cameras` views.
struct Facts {
    std::vector<splat_camera> cameras;
    std::vector<float> inputs;
    std::vector<splat_picture_info> pictures;
    splat_prediction prediction = sized<splat_prediction>();

    Facts(const splat_predictor_info& info, std::size_t views)
        : cameras(views),
          inputs(std::size_t{info.views} * info.channels * info.resolution * info.resolution),
          pictures(info.views) {
        prediction.cameras = cameras.data();
        prediction.camera_capacity = static_cast<std::uint32_t>(views);
        prediction.inputs = inputs.data();
        prediction.input_capacity = inputs.size();
        prediction.pictures = pictures.data();
        prediction.picture_capacity = info.views;
    }
};

/// How pictures are cut out for a network; nothing is wanted yet.
splat_picture_cut_desc cut_for(const splat_predictor_info& info) {
    auto desc = sized<splat_picture_cut_desc>();
    desc.resolution = info.resolution;
    std::copy_n(info.background, 3, desc.background);
    return desc;
}

std::size_t numbers_of_image(const splat_predictor_info& info) {
    return std::size_t{3} * info.resolution * info.resolution;
}

/// Adds a picture as it is cut out, in colours of 0 to 1.
void append_colours(const splat_picture& picture, const splat_predictor_info& info,
                    std::vector<float>& to) {
    std::vector<float> image(numbers_of_image(info));
    splat_picture_cut_desc desc = cut_for(info);
    desc.image = planar_image(image.data(), info.resolution, 3);
    check_data(splat_picture_cut(&picture, &desc, nullptr));
    to.insert(to.end(), image.begin(), image.end());
}

void take_facts(Facts facts, Predicted& task) {
    task.cameras = std::move(facts.cameras);
    task.predict_ms = facts.prediction.network_ms;
    task.faint = facts.prediction.faint;
    task.not_finite = facts.prediction.not_finite;
}

/// The values of a file that holds one array; none without a file.
std::vector<float> vector_of(const std::string& path, const char* option) {
    if (path.empty()) return {};
    const Weights file = load_weights(path);
    std::uint32_t count = 0;
    check(splat_weights_count(file.get(), &count));
    if (count != 1)
        throw Failure(kBadData, std::string(option) + " '" + path + "' holds " +
                                    std::to_string(count) + " arrays, expected one");
    const float* values = nullptr;
    std::uint64_t length = 0;
    check(splat_weights_data(file.get(), 0, &values, &length));
    return {values, values + length};
}

/// Geometry of the picture where something is needed that the options lack; no_mask: nothing has marked the object.
PictureGeometry geometry_of(const PredictionOptions& options, const splat_predictor_info& info,
                            splat_device device, const NetworkMask& mask) {
    const bool no_mask =
        options.mask.empty() && !options.whole && mask.image.pixels == nullptr &&
        found_without_network(load_picture(options.images[0]).image) == SPLAT_FOUND_NOTHING;
    return picture_geometry(options, info, device, no_mask);
}

Predicted read_photo(const PredictionOptions& options, splat_device device,
                     const Network& network) {
    const splat_predictor_info& info = network.info;
    if (info.origin_distance != 0 && !options.origin_distance)
        throw Failure(kUsageError,
                      "the network takes the distance of the object's origin "
                      "(data.origin_distances): give --origin-distance, or predict from --data");
    if (info.plane != 0)
        throw Failure(
            kUsageError,
            "the network takes planes (data.use_pred_plane), which a picture does not "
            "come with: predict from --data, whose plane maps 'vkrun priors plane' makes");
    if (info.origin_distance == 0 && options.origin_distance)
        throw Failure(kUsageError, "--origin-distance: the network takes none");
    const bool depth = info.depth != 0, normal = info.normal != 0;
    const bool one = info.views == 1;  // several views are whole pictures around an object
    NetworkMask mask = one ? network_mask(options) : NetworkMask();
    const PictureGeometry geometry =
        one ? geometry_of(options, info, device, mask) : PictureGeometry();
    const bool has_depth = !options.depth.empty() || geometry.depth.pixels != nullptr;
    const bool has_normal = !options.normal.empty() || geometry.normal.pixels != nullptr;
    if (depth != has_depth || normal != has_normal)
        throw Failure(kUsageError, std::string("the network takes ") + (depth ? "" : "no ") +
                                       "depth and " + (normal ? "" : "no ") +
                                       "normal map: give --depth and --normal to match, or "
                                       "--geometry");
    Predicted task;
    task.name = splat::os::text_of(splat::os::path_of(options.images[0]).stem());
    std::vector<splat_picture> pictures;
    for (std::size_t i = 0; i < options.images.size(); ++i)
        pictures.push_back(picture_of(options, i));
    splat_picture& picture = pictures[0];
    // Poses around an object belong to whole pictures.
    if (info.views > 1)
        for (splat_picture& each : pictures) each.flags |= SPLAT_PICTURE_WHOLE;
    const std::vector<float> embedding = vector_of(options.embedding, "--embedding");
    const std::vector<float> tokens = vector_of(options.tokens, "--tokens");
    picture.embedding = options.embedding.empty() ? nullptr : embedding.data();
    picture.embedding_count = embedding.size();
    picture.tokens = options.tokens.empty() ? nullptr : tokens.data();
    picture.token_count = tokens.size();
    if (geometry.mask.image.pixels != nullptr) mask = geometry.mask;
    picture.mask.pixels = mask.image;
    picture.depth.pixels = geometry.depth;
    picture.normal.pixels = geometry.normal;
    if (geometry.focal > 0) picture.focal = geometry.focal;
    Facts facts(info, info.views);
    check_data(splat_predictor_predict(network.predictor.get(), pictures.data(),
                                       static_cast<std::uint32_t>(pictures.size()),
                                       task.scene.out(), &facts.prediction));
    Json found = library_json(splat_prediction_report, &facts.prediction).at("pictures").at(0);
    for (const Json& warning : found.at("warnings")) task.warnings.push_back(warning);
    for (const char* key : {"width", "height", "mask", "square", "focal", "fov"})
        task.photo[key] = found.at(key);
    if (!mask.preset.empty()) task.photo["mask"] = "network " + mask.preset;
    if (!mask.warning.empty()) task.warnings.push_back(mask.warning);
    for (const std::string& warning : geometry.warnings) task.warnings.push_back(warning);
    if (!geometry.used.empty())
        task.photo["geometry"] = {{"preset", geometry.preset}, {"used", geometry.used}};
    if (found.at("mask") == "nothing" && !options.whole && info.views == 1 && mask.warning.empty())
        task.warnings.emplace_back(
            "no mask model is at hand that cuts objects out: 'vkrun priors where' lists some; or "
            "give --mask");
    if (is_lgm(network.files.config))  // which sees normalised colours
        for (const splat_picture& each : pictures) append_colours(each, info, task.inputs);
    else
        task.inputs.assign(
            facts.inputs.begin(),
            facts.inputs.begin() + static_cast<std::ptrdiff_t>(numbers_of_image(info)));
    take_facts(std::move(facts), task);
    return task;
}

/// What chooses the views of an object and scores images of them.
Evaluator prediction_evaluator(const Network& network, const Dataset& data,
                               std::uint32_t novel_views) {
    auto desc = sized<splat_evaluator_desc>();
    desc.predictor = network.predictor.get();
    desc.dataset = data.get();
    desc.method = "predict";
    desc.novel_views = novel_views;
    Evaluator evaluator;
    check_data(splat_evaluator_create(&desc, evaluator.out()));
    return evaluator;
}

Predicted read_object(const PredictionOptions& options, const Network& network) {
    const Dataset data = open_data(network.files.config, options.data, options.split);
    const Json report = library_json(splat_dataset_report, data.get());
    const auto views_of = report.at("views_of").get<std::vector<std::uint32_t>>();
    if (options.object >= views_of.size())
        throw Failure(kUsageError,
                      format("--object is %u, but there are %zu", options.object, views_of.size()));
    Evaluator evaluator = prediction_evaluator(network, data, options.views);
    const ObjectViews views = read_views(evaluator.get(), options.object, true);
    Predicted task;
    task.name = report.at("names").at(options.object);
    Facts facts(network.info, views.numbers.size());
    check_data(splat_predictor_predict_object(
        network.predictor.get(), data.get(), options.object, views.numbers.data(),
        static_cast<std::uint32_t>(views.numbers.size()), task.scene.out(), &facts.prediction));
    take_facts(std::move(facts), task);
    task.truths = views.images;
    const std::size_t inputs = network.info.views * numbers_of_image(network.info);
    task.inputs.assign(task.truths.begin(),
                       task.truths.begin() + static_cast<std::ptrdiff_t>(inputs));
    task.evaluator = std::move(evaluator);
    return task;
}

/// Cameras around the middle of the visible Gaussians, at the input camera's distance.
std::vector<splat_camera> orbit(const PredictionOptions& options, const Predicted& task) {
    const splat_camera& input = task.cameras.front();
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(task.scene.get(), &info));
    std::vector<float> means(3 * info.count);
    check(splat_scene_read(task.scene.get(), "means", means.data(), means.size() * sizeof(float)));
    double depth = input.world_to_camera[11];
    for (std::size_t i = 0; i < means.size(); ++i)
        depth += input.world_to_camera[8 + i % 3] * static_cast<double>(means[i]) /
                 static_cast<double>(info.count);
    auto desc = sized<splat_orbit_desc>();
    desc.width = desc.height = input.width;
    desc.elevation = options.elevation * std::numbers::pi / 180;
    desc.distance = depth;
    desc.fov_x = 2 * std::atan(0.5 * input.width / input.fx);
    std::vector<splat_camera> cameras(options.views);
    check(splat_camera_orbit(task.scene.get(), &desc, options.views, cameras.data()));
    return cameras;
}

/// Fit s d + t to the true depth by least squares where both are known. The truth is cut out as the
/// picture was; larger is farther.
Json compare_depth(const PredictionOptions& options, splat_device device, const Network& network,
                   const Predicted& task) {
    splat_picture picture = picture_of(options);
    picture.depth.path = options.true_depth.c_str();
    const std::uint32_t side = network.info.resolution;
    const std::size_t pixels = std::size_t{side} * side;
    std::vector<float> truth(pixels), known(pixels);
    splat_picture_cut_desc desc = cut_for(network.info);
    desc.depth = planar_image(truth.data(), side, 1);
    desc.mask = planar_image(known.data(), side, 1);
    check_data(splat_picture_cut(&picture, &desc, nullptr));
    const Depth drawn =
        draw_scene_depth(device, task.scene, task.cameras.front(), network.info.background,
                         convention_of(options.convention));
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
            {"error", error / (most - least)},  // part of the true depth's range
            {"correlation", cov / std::sqrt(vx * vy)}};
}

void add_scores(std::uint32_t object, const Predicted& task, const std::vector<float>& images,
                Json& result) {
    auto scores = sized<splat_object_scores>();
    check(splat_evaluator_score_images(task.evaluator.get(), object, images.data(), images.size(),
                                       &scores));
    result["psnr"] = scores.novel.psnr;
    result["ssim"] = scores.novel.ssim;
    result["novel_views"] = scores.novel.views;
    result["psnr_input"] = scores.conditioning.psnr;
}

/// What the built-in weights do not know, for whoever gives them a picture: whether it shows a car is not known here.
/// Empty for other weights, and for adapters that are not built in either.
std::string built_in_note(const PredictionOptions& options, const NetworkFiles& files) {
    if (options.images.empty() || !is_built_in(files.weights)) return "";
    const std::filesystem::path adapters = splat::os::path_of(files.adapters);
    const bool chairs = adapters.stem() == "chairs" &&
                        adapters.parent_path() == splat::os::path_of(files.weights).parent_path();
    if (!files.adapters.empty() && !chairs) return "";
    const std::string known =
        chairs
            ? "with these adapters know chairs only: anything else comes out like a chair"
            : "know cars only (chairs with --adapters chairs): anything else comes out like a car";
    return "the built-in weights " + known +
           ". 'vkrun weights where' lists published weights for other objects";
}

/// Compares sizes, as the library does once the network is there: one camera sees the views of an object.
void check_sizes(const std::vector<std::string>& pictures) {
    splat_image first{};
    for (const std::string& path : pictures) {
        splat_image image{};
        check(splat_image_load(path.c_str(), &image, nullptr), kBadData);
        if (first.width == 0) first = image;
        if (image.width != first.width || image.height != first.height)
            throw Failure(kBadData, format("'%s' has %u x %u pixels, expected %u x %u as '%s'",
                                           path.c_str(), image.width, image.height, first.width,
                                           first.height, pictures[0].c_str()));
    }
}

}  // namespace

void check_pictures(const PredictionOptions& options, const Json& config) {
    const auto views = config.at("data").at("input_images").get<std::size_t>();
    const std::size_t given = options.images.size();
    if (given == views && is_lgm(config)) return check_sizes(options.images);
    if (given == 0 || (given == views && views == 1)) return;
    const std::string counts =
        format("%zu picture%s, but the network takes %zu", given, given == 1 ? "" : "s", views);
    if (!is_lgm(config))
        throw Failure(kUsageError,
                      counts + (views == 1 ? "" : ", with their poses: predict from --data"));
    throw Failure(
        kUsageError,
        counts +
            ": views of one object from the front, the right, the back and the left "
            "(azimuth 0, 90, 180, 270 degrees, level with it); make them from one picture "
            "with a multi-view diffusion model such as ImageDream, or render or photograph "
            "the object so");
}

std::string weights_of(const PredictionOptions& options) {
    if (!options.weights.empty()) return weights_named(options.weights);
    const bool maps = !options.depth.empty() && !options.normal.empty();
    return weights_named(maps ? kDepthNormalWeights : kPlainWeights);
}

Json run_prediction(const PredictionOptions& given, splat_device device, const Network& network,
                    HtmlPage* also) {
    PredictionOptions options = given;
    if (network.info.whole != 0 && given.foreground)
        throw Failure(kUsageError, "--foreground: the network takes whole pictures");
    const bool by_network = !given.mask_model.empty() || !given.mask_preset.empty();
    if (network.info.whole != 0 && given.data.empty() && !by_network) options.whole = true;
    const NetworkFiles& files = network.files;
    const Predicted task =
        options.data.empty() ? read_photo(options, device, network) : read_object(options, network);
    for (const std::string& warning : task.warnings)
        std::fprintf(stderr, "vkrun: warning: %s\n", warning.c_str());
    const std::string note = built_in_note(options, files);
    if (!note.empty()) std::fprintf(stderr, "vkrun: note: %s\n", note.c_str());
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(task.scene.get(), &info));
    if (info.count == 0)
        throw Failure(kFailed, "the network predicted nothing that can be seen for '" + task.name +
                                   "': is it trained?");
    std::vector<splat_camera> cameras = task.cameras;
    if (task.truths.empty()) {
        const auto around = orbit(options, task);
        cameras.insert(cameras.end(), around.begin(), around.end());
    }
    const Stopwatch drawing;
    const std::vector<float> images = draw_scene(
        device, task.scene, cameras, network.info.background, convention_of(options.convention));
    Json result = {{"input", task.name},
                   {"weights", files.weights},
                   {"adapters", files.adapters},
                   {"trained_for",
                    trained_for(network.info, is_built_in(files.weights), !files.adapters.empty())},
                   {"gaussians", info.count},
                   {"faint", task.faint},
                   {"images", cameras.size()},
                   {"not_finite", task.not_finite},
                   {"draw_ms", drawing.ms()},
                   {"predict_ms", task.predict_ms},
                   {"device", info_of(device).name}};
    if (!task.photo.is_null()) result["photo"] = task.photo;
    if (!note.empty()) result["note"] = note;
    if (!task.warnings.empty()) result["warnings"] = task.warnings;
    if (!task.truths.empty()) add_scores(options.object, task, images, result);
    if (!options.true_depth.empty())
        result["depth"] = compare_depth(options, device, network, task);
    make_folder(options.out);
    check(splat_scene_save(task.scene.get(), (options.out + "/scene.ply").c_str(), nullptr));
    write_prediction_pictures(options.out, network.info, task, images);
    result["report"] = write_prediction_report(options.out, task, network.info, cameras, result);
    if (also != nullptr) add_prediction(*also, options.out, task, network.info, cameras);
    return result;
}

}  // namespace vkrun
