#include "model/camera_embedding.h"

#include <cmath>
#include <numbers>

namespace splat::model {

std::vector<float> pixel_rays(const config::ModelConfig& config) {
    const std::uint32_t r = config.output_resolution();
    const double half_side = r / 2.0;
    const double tangent =
        std::tan(static_cast<double>(config.fov_degrees) * std::numbers::pi / 360.0);
    const double focal = config.fov_degrees > 0 ? half_side / tangent : 1.0;
    std::vector<float> rays(std::size_t{3} * r * r);
    for (std::uint32_t i = 0; i < r; ++i)
        for (std::uint32_t j = 0; j < r; ++j) {
            const double x = (j + 0.5 - half_side) * (config.inverted_x ? -1 : 1);
            const double y = (i + 0.5 - half_side) * (config.inverted_y ? 1 : -1);
            const std::size_t at = std::size_t{i} * r + j;
            rays[at] = static_cast<float>(x / focal);
            rays[at + std::size_t{r} * r] = static_cast<float>(y / focal);
            rays[at + std::size_t{2} * r * r] = 1;
        }
    return rays;
}

std::vector<float> pose_scalars(std::span<const float> view_to_world) {
    std::vector<float> scalars;
    for (std::size_t view = 0; view + 16 <= view_to_world.size(); view += 16)
        for (const std::size_t row : {std::size_t{3}, std::size_t{2}})  // position, viewing axis
            for (std::size_t axis = 0; axis < 3; ++axis)
                scalars.push_back(view_to_world[view + 4 * row + axis]);
    return scalars;
}

std::vector<float> index_scalars(const config::ModelConfig& config, std::uint32_t images) {
    std::vector<float> scalars;
    for (std::uint32_t image = 0; image < images; ++image)
        scalars.push_back(static_cast<float>(image % config.views));
    return scalars;
}

}  // namespace splat::model
