#include "vkrun/weights/model_load.h"

#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

/// Degrees, from the first row of a file's ray grid [1,3,R,R], which holds x / f at the middles of its
/// pixels.
std::optional<double> field_of_view(splat_weights weights) {
    std::uint32_t count = 0;
    check(splat_weights_count(weights, &count));
    for (std::uint32_t i = 0; i < count; ++i) {
        auto info = sized<splat_weights_info>();
        check(splat_weights_get_info(weights, i, &info));
        if (std::string(info.name) != "ray_dirs" || info.rank != 4 || info.dims[3] < 2) continue;
        std::vector<float> rays(info.elements);
        check(splat_weights_read(weights, i, rays.data(), rays.size() * sizeof(float)));
        const auto side = static_cast<double>(info.dims[3]);
        const double last = std::abs(static_cast<double>(rays[info.dims[3] - 1]));
        const double degrees = 2 * std::atan(side / (side - 1) * last) * 180 / std::numbers::pi;
        return std::isfinite(degrees) ? std::optional(degrees) : std::nullopt;
    }
    return std::nullopt;
}

}  // namespace

std::uint32_t graft_flags(const char* option, const std::vector<std::string>& channels) {
    std::uint32_t flags = SPLAT_LOAD_GRAFT;
    for (const std::string& channel : channels) {
        if (channel == "depth")
            flags |= SPLAT_LOAD_FROM_DEPTH;
        else if (channel == "normal")
            flags |= SPLAT_LOAD_FROM_NORMAL;
        else if (channel == "mask")
            flags |= SPLAT_LOAD_FROM_MASK;
        else if (channel == "plane")
            flags |= SPLAT_LOAD_FROM_PLANE;
        else
            throw Failure(kUsageError, std::string(option) + ": '" + channel +
                                           "' is unknown, expected depth, normal, mask or plane");
    }
    return flags;
}

std::string load_counts(const Json& load) {
    return format("%zu tensors copied, %zu widened, %zu new, %zu left out",
                  load.at("copied").size(), load.at("widened").size(), load.at("fresh").size(),
                  load.at("left_out").size());
}

std::string rays_sentence(const std::string& path, splat_weights weights, const Json& report) {
    const Json& load = report.at("load");
    if (!load.at("rays_differ").get<bool>()) return "";
    const bool taken = load.at("rays_taken").get<bool>();
    std::string sentence = "the ray grid of '" + path +
                           "' differs from the configuration's and is " +
                           (taken ? "taken over" : "left out, so that predictions change");
    const auto configured = report.at("config").at("data").at("fov").get<double>();
    const std::optional<double> found = field_of_view(weights);
    if (found && configured > 0)
        sentence +=
            format(": its field of view is %.4g degrees, data.fov %.4g", *found, configured);
    return sentence;
}

void warn_of_rays(const std::string& path, splat_weights weights, const Json& report) {
    const std::string sentence = rays_sentence(path, weights, report);
    if (!sentence.empty()) std::fprintf(stderr, "vkrun: warning: %s\n", sentence.c_str());
}

}  // namespace vkrun
