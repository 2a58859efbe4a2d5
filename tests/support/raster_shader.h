#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace splat::test {

/// True if a shader belongs to shaders/raster, by the names of its stages.
inline bool is_raster_shader(std::string_view name) {
    constexpr std::array<std::string_view, 7> kStages = {
        "blend_", "contribution_", "pose_", "project_", "tile_", "radix_sort_", "raster_"};
    return std::any_of(kStages.begin(), kStages.end(),
                       [&](std::string_view stage) { return name.starts_with(stage); });
}

/// True if a shader belongs to shaders/fit, whose tests run each.
inline bool is_fit_shader(std::string_view name) {
    return name.starts_with("fit_") || name.starts_with("photo_loss_") ||
           name.starts_with("prior_loss_");
}

/// True if a shader belongs to shaders/triangles, whose tests run each.
inline bool is_triangle_shader(std::string_view name) {
    return name.starts_with("triangle_");
}

}  // namespace splat::test
