#include "vkrun/predict/network_mask.h"

#include <cstdlib>
#include <filesystem>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"
#include "vkrun/priors/map_maker.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {
namespace {

/// The first preset that makes nothing but masks and whose model is there; "" for none. Masks of models that
/// also make depth show where a depth is valid, not the object.
std::string preset_at_hand() {
    for (const std::string& name : preset_names()) {
        const Json found = preset_json(name);
        const Json& outputs = found.at("preset").at("outputs");
        std::error_code none;
        if (outputs.size() == 1 && outputs.at(0).at("map") == "mask" &&
            std::filesystem::exists(found.at("path").get<std::string>(), none))
            return name;
    }
    return "";
}

void run_network(const std::string& model, const std::string& preset, const LoadedPicture& picture,
                 NetworkMask& mask) {
    const PriorModel loaded = load_prior_model(model, preset, "", 0, false);
    auto info = sized<splat_prior_model_info>();
    check(splat_prior_model_get_info(loaded.get(), &info));
    mask.bytes.resize(std::size_t{picture.image.width} * picture.image.height);
    splat_prior_maps maps{};
    maps.mask = bytes_image(mask.bytes.data(), picture.image.width, picture.image.height, 1);
    const splat_result result = splat_prior_model_run(loaded.get(), &picture.image, &maps, 1);
    check(result, result == SPLAT_ERROR_INVALID_STATE ? kNotFinite : kBadData);
    mask.preset = info.preset;
    mask.image = maps.mask;
}

}  // namespace

NetworkMask network_mask(const PredictionOptions& options) {
    NetworkMask mask;
    if (!options.mask.empty() || options.whole) return mask;
    std::string model = options.mask_model;
    std::string preset = options.mask_preset;
    const char* const variable = std::getenv("SPLAT_MASK_MODEL");
    if (model.empty() && variable != nullptr) model = variable;
    const bool named = !model.empty() || !preset.empty();
    if (!named) preset = preset_at_hand();
    if (model.empty() && preset.empty()) return mask;
    const LoadedPicture picture = load_picture(options.image);
    if (picture.image.channels == 2 || picture.image.channels == 4) return mask;
    try {
        run_network(model, preset, picture, mask);
    } catch (const Failure& failure) {
        if (named) throw;
        mask.warning =
            "the mask model " + preset + " is at hand, but was not used: " + failure.what();
    }
    return mask;
}

}  // namespace vkrun
