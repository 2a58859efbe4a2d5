#include <algorithm>
#include <cmath>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "data/photograph.h"
#include "prior_models/depth_normals.h"

using namespace splat;

namespace {

Status check_normals_desc(const splat_normals_desc& desc) {
    const std::pair<const char*, double> focals[] = {{"focal_x", desc.focal_x},
                                                     {"focal_y", desc.focal_y}};
    for (const auto& [name, focal] : focals)
        if (!(focal > 0 && std::isfinite(focal)))
            return invalid("splat_normals_desc.%s is %g, expected pixels above 0", name, focal);
    if (!std::isfinite(desc.center_x) || !std::isfinite(desc.center_y))
        return invalid("splat_normals_desc: the centre is not finite");
    const bool distances = desc.nearest == 0 && desc.farthest == 0;
    if (!distances &&
        !(desc.nearest > 0 && desc.farthest > desc.nearest && std::isfinite(desc.farthest)))
        return invalid(
            "splat_normals_desc.nearest is %g and farthest is %g, expected 0 < nearest < "
            "farthest, or both 0 for distances",
            desc.nearest, desc.farthest);
    return {};
}

/// The distances of a depth map.
Result<std::vector<float>> distances_in(const api::ImageView& view,
                                        const splat_normals_desc& desc) {
    std::vector<float> depth = api::interleaved_of(view);
    if (desc.nearest == 0) return depth;
    for (std::size_t i = 0; i < depth.size(); ++i)
        if (!(depth[i] >= 0 && depth[i] <= 1))
            return invalid(
                "depth at row %zu, column %zu is %g, expected relative depth from 0 to 1",
                i / view.width, i % view.width, static_cast<double>(depth[i]));
    prior_models::distances_of(depth, desc.nearest, desc.farthest);
    return depth;
}

}  // namespace

splat_result splat_picture_mask(const splat_image* picture, const splat_image* mask,
                                splat_found* found) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const api::ImageView from, api::image_to_read(picture, "picture"));
        SPLAT_ASSIGN(const api::ImageView to, api::image_to_fill(mask, "mask"));
        SPLAT_TRY(api::check_image_size(to, "mask", from.width, from.height, 1));
        data::MaskFrom way = data::MaskFrom::kNothing;
        SPLAT_ASSIGN(const std::vector<std::uint8_t> bytes,
                     data::mask_of(api::image_of(from), way));
        std::vector<float> values(bytes.size());
        std::ranges::transform(bytes, values.begin(),
                               [](std::uint8_t byte) { return static_cast<float>(byte) / 255; });
        api::fill_interleaved(to, values.data());
        if (found != nullptr) *found = static_cast<splat_found>(way);
        return {};
    });
}

splat_result splat_normals_from_depth(const splat_image* depth, const splat_normals_desc* desc,
                                      const splat_image* normal) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const api::ImageView from, api::image_to_read(depth, "depth"));
        SPLAT_TRY(api::check_image_size(from, "depth", from.width, from.height, 1));
        SPLAT_TRY(api::check_desc(desc, 0));
        SPLAT_TRY(check_normals_desc(*desc));
        SPLAT_ASSIGN(const api::ImageView to, api::image_to_fill(normal, "normal"));
        SPLAT_TRY(api::check_image_size(to, "normal", from.width, from.height, 3));
        SPLAT_ASSIGN(const std::vector<float> distances, distances_in(from, *desc));
        prior_models::DepthCamera camera{from.width,    from.height,    desc->focal_x,
                                         desc->focal_y, desc->center_x, desc->center_y};
        if (desc->center_x == 0 && desc->center_y == 0) {
            camera.center_x = from.width / 2.0;
            camera.center_y = from.height / 2.0;
        }
        std::vector<float> values = prior_models::normals_of(distances, camera);
        for (float& value : values) {
            value = (value + 1) / 2;
            if (to.type == SPLAT_PIXEL_U8) value = std::trunc(value * 255) / 255;
        }
        api::fill_interleaved(to, values.data());
        return {};
    });
}
