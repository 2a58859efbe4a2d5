#include <algorithm>
#include <cmath>
#include <cstring>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/predict/picture_arguments.h"
#include "api/scene/camera_value.h"
#include "config/config_file.h"
#include "config/presets.h"
#include "core/json_writer.h"
#include "core/stopwatch.h"
#include "io/file.h"
#include "model/adapters.h"
#include "predict/published.h"
#include "predict/weights_place.h"

using namespace splat;

namespace {

using PredictorPointer = std::shared_ptr<api::PredictorObject>;

using WeightsPointer = std::shared_ptr<const io::WeightsFile>;

/// The weights of a handle, else of a path, else nullptr.
Result<WeightsPointer> predictor_weights(const char* path, splat_weights weights,
                                         const char* member) {
    if (weights != nullptr) {
        SPLAT_ASSIGN(const auto object, api::weights_to_use(weights, member));
        return WeightsPointer(object, &object->file);
    }
    if (path == nullptr) return WeightsPointer();
    SPLAT_ASSIGN(io::WeightsFile file, io::load_weights(path, decode_limits(), true));
    return WeightsPointer(std::make_shared<const io::WeightsFile>(std::move(file)));
}

/// The published configuration that weights fit. Errors: kNotFound, with `why` and those that come near.
Result<config::Settings> published_settings(const io::WeightsFile& file, const std::string& weights,
                                            const Status& why) {
    const predict::PublishedFit fit = predict::published_fit(file.tensors, weights);
    if (fit.names.size() != 1)
        return not_found("%s; %s", why.message().c_str(), fit.sentence().c_str());
    SPLAT_ASSIGN(const config::Preset preset, config::preset_of(fit.names[0]));
    return predict::settings_of(std::string(preset.text), fit.names[0]);
}

Result<config::Settings> predictor_settings(const char* text, const io::WeightsFile& read,
                                            const std::string& weights, const char* adapters) {
    if (text != nullptr) return predict::settings_of(text, "configuration");
    if (weights.empty())
        return invalid(
            "splat_predictor_desc.config is NULL, expected a text with a handle of weights");
    const auto path = predict::config_beside(weights, adapters == nullptr ? "" : adapters);
    if (path.status().code() == Code::kNotFound)
        return published_settings(read, weights, path.status());
    SPLAT_TRY(path.status());
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path.value()));
    return predict::settings_of(std::string(io::as_text(file)), "'" + path.value() + "'");
}

/// Weights that do not fit the configuration are a matter of their file, not of an argument.
Status of_weights(const Status& loaded) {
    if (loaded.code() != Code::kInvalidArgument) return loaded;
    return {Code::kFormat, loaded.message()};
}

Status check_adapters(const splat_predictor_desc& desc) {
    if (desc.adapters_path != nullptr && desc.adapters != nullptr)
        return invalid(
            "splat_predictor_desc: adapters_path and adapters are both given, expected "
            "one of them");
    if (!std::isfinite(desc.adapters_alpha))
        return invalid("splat_predictor_desc.adapters_alpha is %g, expected a finite number",
                       desc.adapters_alpha);
    return {};
}

/// The weights with the adapters folded in.
Result<WeightsPointer> with_adapters(const WeightsPointer& weights,
                                     const splat_predictor_desc& desc,
                                     const config::ModelConfig& network) {
    SPLAT_ASSIGN(const WeightsPointer adapters,
                 predictor_weights(desc.adapters_path, desc.adapters, "adapters"));
    if (adapters == nullptr) return weights;
    if (!model::has_adapters(adapters->tensors))
        return damaged("the adapters have no tensors '<layer>.lora_A'");
    double alpha = desc.adapters_alpha;
    if (alpha == 0) SPLAT_SET(alpha, predict::adapters_alpha(*adapters, network));
    io::WeightsFile folded;
    folded.metadata = weights->metadata;
    auto merged = model::merge_adapters(weights->tensors, adapters->tensors, alpha, 1);
    SPLAT_TRY(of_weights(merged.status()));
    folded.tensors = std::move(merged.value());
    SPLAT_TRY(adapters->tensors.unchanged());
    return WeightsPointer(std::make_shared<const io::WeightsFile>(std::move(folded)));
}

/// What was noticed about the weights, in sentences.
std::vector<std::string> predictor_warnings(const std::string& name, const io::WeightsFile& file,
                                            const model::LoadReport& load,
                                            const config::ModelConfig& network) {
    if (!load.rays_differ) return {};
    std::string sentence =
        "the ray grid of '" + name + "' differs from the configuration's and is taken over";
    const std::optional<double> fov = predict::field_of_view(file.tensors);
    if (fov && network.fov_degrees > 0)
        sentence += format(": its field of view is %.4g degrees, data.fov %.4g", *fov,
                           static_cast<double>(network.fov_degrees));
    return {sentence};
}

std::string predictor_report(const api::PredictorObject& object, const io::WeightsFile& file,
                             const model::LoadReport& load,
                             const std::vector<std::string>& warnings) {
    JsonWriter json;
    json.begin_object().member("weights", object.path).key("warnings").list(warnings);
    json.key("ignored").list(file.warnings);
    json.newline(1).member("category", object.settings.training.category);
    json.key("metadata").begin_object();
    for (const auto& [key, value] : file.metadata) json.member(key, value);
    json.end().newline(1).key("load").begin_object().member("rays_differ", load.rays_differ);
    json.member("rays_taken", load.rays_taken).key("copied").list(load.copied);
    json.key("widened").list(load.widened).key("fresh").list(load.fresh);
    json.key("left_out").list(load.left_out).end();
    json.newline(1).key("config").raw(config::merged_config_text(object.settings)).end();
    return json.text();
}

/// How an aggregation draws its views.
Result<raster::Convention> convention_of(const splat_predictor_desc& desc) {
    if (desc.convention == 0 || desc.convention == SPLAT_CONVENTION_3DGS)
        return raster::Convention::k3dgs;
    if (desc.convention == SPLAT_CONVENTION_RAY_MAXIMUM) return raster::Convention::kRayMaximum;
    return invalid(
        "splat_predictor_desc.convention is %d, expected 0, SPLAT_CONVENTION_3DGS or "
        "SPLAT_CONVENTION_RAY_MAXIMUM",
        desc.convention);
}

Result<PredictorPointer> make_predictor(splat_device device, const splat_predictor_desc& desc) {
    SPLAT_ASSIGN(const auto owner, api::find(device));
    SPLAT_TRY(check_adapters(desc));
    auto object = std::make_shared<api::PredictorObject>(owner->context);
    if (desc.weights_path != nullptr) object->path = desc.weights_path;
    if (desc.weights == nullptr)
        SPLAT_SET(object->path, desc.weights_path == nullptr
                                    ? predict::builtin_weights(predict::kDefaultWeights)
                                    : predict::weights_named(desc.weights_path));
    SPLAT_ASSIGN(const WeightsPointer weights,
                 predictor_weights(object->path.c_str(), desc.weights, "weights"));
    SPLAT_ASSIGN(object->settings,
                 predictor_settings(desc.config, *weights, object->path, desc.adapters_path));
    SPLAT_SET(object->aggregation.convention, convention_of(desc));
    object->aggregation.views = desc.aggregate;
    SPLAT_TRY(predict::check_aggregation(object->settings.network, desc.aggregate));
    SPLAT_TRY(of_weights(predict::expect_network(weights->tensors, object->settings.network)));
    SPLAT_ASSIGN(const WeightsPointer file, with_adapters(weights, desc, object->settings.network));
    model::LoadReport load;
    vk::Context& context = *owner->context;
    SPLAT_TRY(context.mutex.call(
        [&] { return predict::Predictor::check(context, object->settings, *file); }));
    SPLAT_TRY(owner->test(api::kNetworkKernels | api::kRasterKernels));
    {
        const std::lock_guard lock(context.mutex);
        SPLAT_TRY(context.device().alive());
        SPLAT_ASSIGN(object->predictor, predict::Predictor::create(context, object->settings));
        SPLAT_TRY(of_weights(object->predictor->load(*file, load)));
    }
    SPLAT_TRY(weights->tensors.unchanged());
    object->report =
        predictor_report(*object, *file, load,
                         predictor_warnings(object->path, *file, load, object->settings.network));
    const std::optional<double> fov = predict::field_of_view(file->tensors);
    if (load.rays_taken && fov) object->settings.network.fov_degrees = static_cast<float>(*fov);
    return object;
}

/// The predicted Gaussians that an image can show.
Result<gaussians::Downloaded> run(api::PredictorObject& object, const predict::Views& views) {
    const std::lock_guard lock(object.context->mutex);
    gaussians::Downloaded joined;
    if (object.aggregation.views > 0)
        SPLAT_SET(joined, object.predictor->aggregate(views, object.aggregation));
    else
        SPLAT_TRY(object.predictor->predict(views));
    const bool finite = object.predictor->ledger().outputs_not_finite == 0;
    if (finite && object.aggregation.views > 0) return joined;
    if (finite) return object.predictor->scene();
    return bad_state(
        "the network's output is not finite: numbers of the weights%s overflow "
        "float32 in its layers; give others, or train again",
        object.path.empty() ? "" : (" '" + object.path + "'").c_str());
}

/// What splat_prediction receives, of one call.
struct Predicted {
    predict::Views views;
    std::vector<splat_picture_info> pictures;
    double read_ms = 0;
};

/// Fill the caller's struct. Returns whether all of it fitted.
bool give_prediction(const Predicted& from, const gaussians::Downloaded& visible, double network_ms,
                     splat_prediction* prediction) {
    if (prediction == nullptr) return true;
    splat_prediction filled{};
    const std::uint32_t size = std::min<std::uint32_t>(prediction->struct_size, sizeof filled);
    std::memcpy(&filled, prediction, size);
    filled.camera_count = static_cast<std::uint32_t>(from.views.cameras.size());
    filled.picture_count = static_cast<std::uint32_t>(from.pictures.size());
    filled.gaussians = visible.gaussians.count();
    filled.not_finite = visible.not_finite;
    filled.faint = visible.faint;
    filled.read_ms = from.read_ms;
    filled.network_ms = network_ms;
    const auto given = [](const auto& values, auto* to, std::uint64_t capacity, auto convert) {
        const std::size_t fitting =
            to == nullptr ? 0 : std::min<std::uint64_t>(capacity, values.size());
        std::transform(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(fitting), to,
                       convert);
        return to == nullptr || fitting == values.size();
    };
    const bool cameras = given(from.views.cameras, filled.cameras, filled.camera_capacity,
                               [](const scene::Camera& camera) { return api::value_of(camera); });
    const bool pictures = given(from.pictures, filled.pictures, filled.picture_capacity,
                                [](const splat_picture_info& info) { return info; });
    const bool inputs = given(from.views.inputs, filled.inputs, filled.input_capacity,
                              [](float value) { return value; });
    std::memcpy(prediction, &filled, size);
    return cameras && pictures && inputs;
}

/// Read by `read(object)`, predict, and give scene and facts.
template <class Read>
splat_result predict_with(splat_predictor predictor, splat_scene* scene,
                          splat_prediction* prediction, Read&& read) {
    bool fitted = true;
    const auto predict = [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(scene, "scene"));
        if (prediction != nullptr) SPLAT_TRY(api::check_size(*prediction));
        Stopwatch clock;
        Predicted made;
        SPLAT_TRY(read(*object, made));
        made.read_ms = 1e3 * clock.lap();
        SPLAT_ASSIGN(gaussians::Downloaded visible, run(*object, made.views));
        fitted = give_prediction(made, visible, 1e3 * clock.lap(), prediction);
        auto added = std::make_shared<api::SceneObject>();
        added->gaussians = std::move(visible.gaussians);
        *scene = api::Scenes::add(std::move(added));
        return {};
    };
    const splat_result result = api::with(predictor, predict);
    return result == SPLAT_OK && !fitted ? SPLAT_INCOMPLETE : result;
}

}  // namespace

splat_result splat_builtin_weights(const char* name, char* buffer, size_t capacity,
                                   size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        return predict::builtin_weights(name == nullptr ? predict::kDefaultWeights : name);
    });
}

splat_result splat_predictor_create(splat_device device, const splat_predictor_desc* desc,
                                    splat_predictor* predictor) {
    return api::create(predictor, [&]() -> Result<PredictorPointer> {
        splat_predictor_desc full{};
        if (desc != nullptr) {
            SPLAT_TRY(api::check_desc(desc, 0));
            SPLAT_TRY(api::take_input(desc, "desc", full));
        }
        return make_predictor(device, full);
    });
}

splat_result splat_predictor_get_info(splat_predictor predictor, splat_predictor_info* info) {
    return api::describe(predictor, info, "info", [](auto& object) {
        const config::ModelConfig& network = object.settings.network;
        splat_predictor_info filled{};
        SPLAT_COPY(filled, network, views, resolution, depth, normal, mask, plane, origin_distance,
                   sh_degree);
        filled.channels = network.input_channels();
        filled.gaussians = std::uint64_t{network.gaussians()} * (1 + object.aggregation.views);
        filled.whole = predict::takes_whole_pictures(network) ? 1 : 0;
        filled.depth |= filled.whole;
        filled.fov_degrees = static_cast<double>(network.fov_degrees);
        const std::array<float, 3> background = predict::background_of(object.settings);
        std::ranges::copy(background, filled.background);
        filled.category = object.settings.training.category.c_str();
        return filled;
    });
}

splat_result splat_predictor_report(splat_predictor predictor, char* buffer, size_t capacity,
                                    size_t* needed) {
    return api::report(predictor, buffer, capacity, needed,
                       [](auto& object) { return object.report; });
}

splat_result splat_predictor_predict(splat_predictor predictor, const splat_picture* pictures,
                                     uint32_t count, splat_scene* scene,
                                     splat_prediction* prediction) {
    const auto read = [&](const api::PredictorObject& object, Predicted& made) -> Status {
        SPLAT_ASSIGN(const auto inputs, api::picture_inputs(pictures, count));
        const config::ModelConfig& network = object.settings.network;
        SPLAT_ASSIGN(
            predict::PictureViews views,
            predict::views_of_pictures(network, predict::background_of(object.settings), inputs));
        made.views = std::move(views.views);
        for (const predict::PictureFacts& facts : views.facts)
            made.pictures.push_back(
                api::info_of(facts, predict::field_of_view_differs(network, facts)));
        return {};
    };
    return predict_with(predictor, scene, prediction, read);
}

splat_result splat_predictor_predict_object(splat_predictor predictor, splat_dataset dataset,
                                            uint32_t object, const uint32_t* views, uint32_t count,
                                            splat_scene* scene, splat_prediction* prediction) {
    const auto read = [&](const api::PredictorObject& from, Predicted& made) -> Status {
        SPLAT_ASSIGN(const auto data, api::find(dataset));
        SPLAT_TRY(api::require(views, "views"));
        const std::uint32_t inputs = from.settings.network.views;
        if (count < inputs)
            return invalid("count is %u, expected at least %u, the network's input views", count,
                           inputs);
        SPLAT_ASSIGN(const auto source,
                     predict::ViewSource::open(predict::without_map_losses(from.settings),
                                               {data, data->dataset.get()}));
        SPLAT_ASSIGN(made.views, source->read(object, {views, count}, inputs));
        return {};
    };
    return predict_with(predictor, scene, prediction, read);
}

splat_result splat_prediction_report(const splat_prediction* prediction, char* buffer,
                                     size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        splat_prediction taken{};
        SPLAT_TRY(api::take_input(prediction, "prediction", taken));
        return api::prediction_text(taken);
    });
}
