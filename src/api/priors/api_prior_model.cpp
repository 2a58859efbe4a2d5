#include "api/core/image_view.h"
#include "api/handles.h"
#include "api/priors/moge_network.h"
#include "core/fork.h"
#include "core/json_writer.h"
#include "core/log.h"
#include "prior_models/point_depth.h"

using namespace splat;

namespace {

using prior_models::MapForm;

constexpr data::MapKind kDepth = data::MapKind::kDepth;

/// Points tell the camera.
bool tells_focal(const prior_models::PriorModel& model) {
    const prior_models::PresetOutput* const depth = model.preset().find(kDepth);
    return depth != nullptr && depth->depth == prior_models::DepthOf::kPoints;
}

/// A preset and its path as JSON.
Result<std::string> preset_report(const std::string& name) {
    SPLAT_ASSIGN(const prior_models::Preset preset, prior_models::preset_of(name));
    SPLAT_ASSIGN(const std::string text, prior_models::preset_text(name));
    JsonWriter json;
    json.begin_object().member("path", prior_models::preset_path(preset));
    return json.newline(1).key("preset").raw(text).end().text();
}

std::string text_or_empty(const char* text) {
    return text == nullptr ? "" : text;
}

/// A map to fill, if it is wanted.
struct MapTarget {
    const char* name;
    splat_image splat_prior_maps::*image;
    data::MapKind kind;
};

constexpr MapTarget kMapTargets[] = {{"depth", &splat_prior_maps::depth, data::MapKind::kDepth},
                                     {"normal", &splat_prior_maps::normal, data::MapKind::kNormal},
                                     {"mask", &splat_prior_maps::mask, data::MapKind::kMask}};

/// The maps of one picture.
struct Targets {
    std::optional<api::ImageView> views[std::size(kMapTargets)];
    prior_models::WantedMaps wanted;
};

Result<Targets> targets_of(const splat_prior_maps& maps, const io::Image& picture, bool numbers,
                           std::uint32_t index) {
    Targets targets;
    for (std::size_t t = 0; t < std::size(kMapTargets); ++t) {
        const MapTarget& target = kMapTargets[t];
        const splat_image& image = maps.*target.image;
        if (image.pixels == nullptr) continue;
        const std::string name = splat::format("maps[%u].%s", index, target.name);
        SPLAT_ASSIGN(const api::ImageView view, api::image_to_fill(&image, name.c_str()));
        SPLAT_TRY(api::check_image_size(view, name.c_str(), picture.width, picture.height,
                                        data::channels_of(target.kind)));
        targets.views[t] = view;
        const bool bytes = view.type == SPLAT_PIXEL_U8;
        targets.wanted[target.kind] = bytes     ? MapForm::kBytes
                                      : numbers ? MapForm::kModels
                                                : MapForm::kUnit;
    }
    return targets;
}

/// Fill the caller's maps.
void give_maps(const Targets& targets, const prior_models::PriorMaps& made) {
    for (std::size_t t = 0; t < std::size(kMapTargets); ++t) {
        if (!targets.views[t]) continue;
        std::vector<float> values = made[kMapTargets[t].kind]->values;
        if (targets.views[t]->type == SPLAT_PIXEL_U8)
            for (float& value : values) value /= 255;
        api::fill_interleaved(*targets.views[t], values.data());
    }
}

/// `focals` may be nullptr.
Status run_model(const api::PriorModelObject& object, std::span<const splat_image> pictures,
                 std::span<const splat_prior_maps> maps, double* focals) {
    if (object.generation != fork_generation())
        return bad_state(
            "model: its threads belong to the process that this one was forked from; "
            "create another");
    std::vector<io::Image> images;
    std::vector<Targets> targets;
    std::vector<prior_models::WantedMaps> wanted;
    for (std::uint32_t i = 0; i < pictures.size(); ++i) {
        SPLAT_ASSIGN(const api::ImageView view,
                     api::image_to_read(&pictures[i], splat::format("pictures[%u]", i).c_str()));
        images.push_back(api::image_of(view));
        SPLAT_ASSIGN(targets.emplace_back(), targets_of(maps[i], images.back(), object.numbers, i));
        wanted.push_back(targets.back().wanted);
        if (focals != nullptr && tells_focal(*object.model) && !wanted.back()[kDepth])
            wanted.back()[kDepth] = MapForm::kModels;
    }
    SPLAT_ASSIGN(const std::vector<prior_models::PriorMaps> made,
                 object.model->run(images, wanted));
    for (std::size_t i = 0; i < made.size(); ++i) {
        give_maps(targets[i], made[i]);
        if (focals == nullptr) continue;
        const std::optional<prior_models::PriorMap>& depth = made[i][kDepth];
        focals[i] = depth ? depth->focal : 0;
        if (depth && depth->guessed)
            log(LogLevel::kWarning,
                splat::format(
                    "pictures[%zu]: no camera sees the points that '%s' makes, so its focal "
                    "length, %.4g pixels, is a guess: %g degrees across the width",
                    i, object.model->preset().name.c_str(), focals[i],
                    prior_models::kOtherwiseDegrees));
    }
    return {};
}

/// Checks the arguments of both functions that run a model.
Status run_handle(splat_prior_model model, const splat_image* pictures,
                  const splat_prior_maps* maps, double* focals, std::uint32_t count) {
    SPLAT_TRY(api::require(pictures, "pictures", maps, "maps"));
    if (count == 0) return invalid("count is 0, expected at least 1");
    SPLAT_ASSIGN(const auto object, api::find(model));
    return run_model(*object, {pictures, count}, {maps, count}, focals);
}

/// Opens weights on the caller's device.
prior_models::OpenWeights weights_on(splat_device device) {
    return [device](const std::string& path) -> Result<std::unique_ptr<prior_models::Network>> {
        if (device == nullptr)
            return invalid(
                "splat_prior_model_desc.device is NULL, but '%s' holds weights, which run on a "
                "device",
                path.c_str());
        SPLAT_ASSIGN(const auto owner, api::Devices::find(device, "splat_prior_model_desc.device"));
        return api::open_moge(*owner, path);
    };
}

}  // namespace

splat_result splat_prior_preset(const char* name, char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        if (name == nullptr) return JsonWriter().list(prior_models::preset_names()).text();
        return preset_report(name);
    });
}

splat_result splat_prior_model_create(const splat_prior_model_desc* desc,
                                      splat_prior_model* model) {
    return api::create(model, [&]() -> api::PriorModels::Made {
        SPLAT_TRY(api::check_desc(desc, SPLAT_PRIOR_MODEL_NUMBERS));
        splat_prior_model_desc given{};
        SPLAT_TRY(api::take_input(desc, "desc", given));
        constexpr std::uint32_t kMostThreads = 1024;
        if (desc->threads > kMostThreads)
            return invalid("splat_prior_model_desc.threads is %u, expected at most %u",
                           desc->threads, kMostThreads);
        if (desc->preset == nullptr && desc->model_path == nullptr)
            return invalid("splat_prior_model_desc has neither a preset nor a model_path");
        auto object = std::make_shared<api::PriorModelObject>();
        object->numbers = (desc->flags & SPLAT_PRIOR_MODEL_NUMBERS) != 0;
        object->generation = fork_generation();
        SPLAT_ASSIGN(object->model,
                     prior_models::PriorModel::create(
                         {text_or_empty(desc->preset), text_or_empty(desc->model_path),
                          text_or_empty(desc->runtime_path), desc->threads, desc->tokens,
                          weights_on(given.device)}));
        return object;
    });
}

splat_result splat_prior_model_get_info(splat_prior_model model, splat_prior_model_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::check_fill(info, "info"));
        SPLAT_ASSIGN(const auto object, api::find(model));
        const prior_models::Preset& preset = object->model->preset();
        splat_prior_model_info filled{};
        filled.maps = preset.maps();
        filled.width = object->model->input_size().width;
        filled.height = object->model->input_size().height;
        filled.preset = preset.name.c_str();
        filled.licence = preset.licence.c_str();
        filled.note = preset.note.c_str();
        filled.path = object->model->network().path().c_str();
        filled.runtime_version = object->model->network().runtime_version().c_str();
        api::give(filled, info);
        return {};
    });
}

splat_result splat_prior_model_run(splat_prior_model model, const splat_image* pictures,
                                   const splat_prior_maps* maps, uint32_t count) {
    return api::guarded(
        [&]() -> Status { return run_handle(model, pictures, maps, nullptr, count); });
}

splat_result splat_prior_model_run_focal(splat_prior_model model, const splat_image* pictures,
                                         const splat_prior_maps* maps, double* focals,
                                         uint32_t count) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(focals, "focals"));
        return run_handle(model, pictures, maps, focals, count);
    });
}
