#include "vkrun/predict/geometry.h"

#include <filesystem>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {
namespace {

namespace os = splat::os;

bool exists(const std::string& path) {
    std::error_code none;
    return std::filesystem::is_regular_file(os::path_of(path), none);
}

/// The first preset that makes depth, normals and masks and whose model is there; "" for none.
std::string geometry_preset_at_hand() {
    for (const std::string& name : preset_names()) {
        const Json found = preset_json(name);
        if (found.at("preset").at("outputs").size() == 3 && exists(found.at("path"))) return name;
    }
    return "";
}

/// What the options name, a file or a preset, or what is at hand; without either none is set.
ModelSource source_of(const PredictionOptions& options, splat_device device) {
    ModelSource source;
    source.on = device;
    if (options.geometry.empty())
        source.preset = geometry_preset_at_hand();
    else if (exists(options.geometry))
        source.model = options.geometry;
    else
        source.preset = options.geometry;
    return source;
}

double exif_focal(const std::string& path) {
    auto info = sized<splat_image_info>();
    splat_image image{};
    check(splat_image_load(path.c_str(), &image, &info), kBadData);
    return info.focal;
}

}  // namespace

PictureGeometry run_geometry(const ModelSource& source, const LoadedPicture& picture,
                             const WantedGeometry& wanted) {
    PictureGeometry made;
    const std::uint32_t width = picture.image.width, height = picture.image.height;
    const PriorModel model = load_prior_model(source);
    auto about = sized<splat_prior_model_info>();
    check(splat_prior_model_get_info(model.get(), &about));
    made.preset = about.preset;
    splat_prior_maps maps{};
    const auto want = [&](const char* what, std::uint32_t flag, std::uint32_t channels,
                          std::vector<std::uint8_t>& bytes) {
        if ((about.maps & flag) == 0)
            throw Failure(kUsageError, "preset '" + made.preset + "' makes no " + what);
        bytes.resize(std::size_t{width} * height * channels);
        made.used.emplace_back(what);
        return bytes_image(bytes.data(), width, height, channels);
    };
    if (wanted.depth) maps.depth = want("depth", SPLAT_DATA_DEPTH, 1, made.depth_bytes);
    if (wanted.normal) maps.normal = want("normals", SPLAT_DATA_NORMAL, 3, made.normal_bytes);
    if (wanted.mask) maps.mask = want("mask", SPLAT_DATA_MASK, 1, made.mask.bytes);
    if (wanted.focal) made.used.emplace_back("focal length");
    const splat_result result =
        wanted.focal
            ? splat_prior_model_run_focal(model.get(), &picture.image, &maps, &made.focal, 1)
            : splat_prior_model_run(model.get(), &picture.image, &maps, 1);
    check(result, result == SPLAT_ERROR_INVALID_STATE ? kNotFinite : kBadData);
    made.depth = maps.depth;
    made.normal = maps.normal;
    if (!wanted.mask) return made;
    made.mask.image = maps.mask;
    made.mask.preset = made.preset;
    drop_without_object(made.mask);
    if (made.mask.preset.empty()) std::erase(made.used, "mask");
    if (!made.mask.warning.empty()) made.warnings.push_back(made.mask.warning);
    return made;
}

PictureGeometry picture_geometry(const PredictionOptions& options, const splat_predictor_info& info,
                                 splat_device device, bool no_mask) {
    const WantedGeometry wanted = {
        info.depth != 0 && options.depth.empty(), info.normal != 0 && options.normal.empty(),
        info.fov_degrees == 0 && !options.focal && exif_focal(options.images[0]) == 0, no_mask};
    const bool named = !options.geometry.empty();
    PictureGeometry none;
    if (!wanted.any() && !named) return none;
    const ModelSource source = source_of(options, device);
    if (source.model.empty() && source.preset.empty()) return none;
    if (!wanted.any()) {
        if (source.model.empty()) preset_json(source.preset);  // throws if there is none
        none.warnings.push_back("--geometry " + options.geometry +
                                " was not used: what it makes is given, or not needed");
        return none;
    }
    try {
        return run_geometry(source, load_picture(options.images[0]), wanted);
    } catch (const Failure& failure) {
        if (named) throw;
        none.warnings.push_back("the model " + source.preset +
                                " is at hand, but was not used: " + failure.what());
        return none;
    }
}

}  // namespace vkrun
