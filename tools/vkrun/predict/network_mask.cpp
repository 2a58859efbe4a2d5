#include "vkrun/predict/network_mask.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "core/os/path.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/text.h"
#include "vkrun/predict/geometry.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {

splat_found found_without_network(const splat_image& picture) {
    std::vector<std::uint8_t> bytes(std::size_t{picture.width} * picture.height);
    const splat_image mask = bytes_image(bytes.data(), picture.width, picture.height, 1);
    splat_found found = 0;
    check(splat_picture_mask(&picture, &mask, &found));
    return found;
}

void drop_without_object(NetworkMask& mask) {
    constexpr double kLeastMask = 0.01, kMostMask = 0.95;
    const auto inside = std::count_if(mask.bytes.begin(), mask.bytes.end(),
                                      [](std::uint8_t value) { return value > 127; });
    const double part = static_cast<double>(inside) / static_cast<double>(mask.bytes.size());
    if (part >= kLeastMask && part <= kMostMask) return;
    NetworkMask none;
    none.warning = format(
        "the mask of the network %s was not used: %.3g %% of the picture is inside, expected 1 to "
        "95 %%",
        mask.preset.c_str(), 100 * part);
    mask = std::move(none);
}

std::string mask_preset_at_hand() {
    for (const std::string& name : preset_names()) {
        const Json found = preset_json(name);
        const Json& outputs = found.at("preset").at("outputs");
        std::error_code none;
        if (outputs.size() == 1 && outputs.at(0).at("map") == "mask" &&
            std::filesystem::exists(splat::os::path_of(found.at("path").get<std::string>()), none))
            return name;
    }
    return "";
}

NetworkMask network_mask(const PredictionOptions& options) {
    NetworkMask mask;
    if (!options.mask.empty() || options.whole) return mask;
    ModelSource source;
    source.model = options.mask_model;
    source.preset = options.mask_preset;
    const char* const variable = std::getenv("SPLAT_MASK_MODEL");
    if (source.model.empty() && variable != nullptr) source.model = variable;
    const bool named = !source.model.empty() || !source.preset.empty();
    if (!named) source.preset = mask_preset_at_hand();
    if (source.model.empty() && source.preset.empty()) return mask;
    const LoadedPicture picture = load_picture(options.images[0]);
    if (found_without_network(picture.image) == SPLAT_FOUND_BY_ALPHA) return mask;
    try {
        mask = run_geometry(source, picture, {.mask = true}).mask;
    } catch (const Failure& failure) {
        if (named) throw;
        mask.warning =
            "the mask model " + source.preset + " is at hand, but was not used: " + failure.what();
    }
    return mask;
}

}  // namespace vkrun
