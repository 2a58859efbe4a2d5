#include <algorithm>
#include <array>
#include <cmath>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "data/photograph.h"
#include "prior_models/depth_normals.h"
#include "prior_scores/plane_map.h"

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

prior_models::DepthCamera camera_of(const api::ImageView& depth, const splat_normals_desc& desc) {
    const bool middle = desc.center_x == 0 && desc.center_y == 0;
    return {depth.width,
            depth.height,
            desc.focal_x,
            desc.focal_y,
            middle ? depth.width / 2.0 : desc.center_x,
            middle ? depth.height / 2.0 : desc.center_y};
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

/// [height, width, 3]: those of a map, or without one of the surface.
Result<std::vector<float>> normals_in(const splat_image* normal, bool vectors,
                                      std::span<const float> distances,
                                      const prior_models::DepthCamera& camera) {
    if (normal == nullptr) return prior_models::normals_of(distances, camera);
    SPLAT_ASSIGN(const api::ImageView view, api::image_to_read(normal, "normal"));
    SPLAT_TRY(api::check_image_size(view, "normal", camera.width, camera.height, 3));
    std::vector<float> normals = api::interleaved_of(view);
    if (!vectors)
        for (float& n : normals) n = 2 * n - 1;
    return normals;
}

/// [height, width, 4]: normals and distances, or with `share` as numbers from 0 to 1, where 0 in bytes is no plane.
std::vector<float> numbers_of(const prior_scores::PlaneMap& map, bool share) {
    double farthest = 0;
    for (const prior_scores::FoundPlane& plane : map.planes)
        farthest = std::max(farthest, plane.distance);
    std::vector<std::array<float, 4>> planes = {{}};
    for (const auto& [normal, distance, pixels] : map.planes) {
        std::array<double, 4> n = {normal.x, normal.y, normal.z, distance};
        if (share)
            n = {(n[0] + 1) / 2, (n[1] + 1) / 2, (n[2] + 1) / 2,
                 std::max(distance / farthest, 1.0 / 255)};
        planes.push_back({static_cast<float>(n[0]), static_cast<float>(n[1]),
                          static_cast<float>(n[2]), static_cast<float>(n[3])});
    }
    std::vector<float> numbers;
    numbers.reserve(4 * map.ids.size());
    for (const std::uint32_t id : map.ids)
        numbers.insert(numbers.end(), planes[id].begin(), planes[id].end());
    return numbers;
}

/// The default where the caller gave 0.
double value_or(double given, double otherwise) {
    return given == 0 ? otherwise : given;
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
        std::vector<float> values = prior_models::normals_of(distances, camera_of(from, *desc));
        for (float& value : values) {
            value = (value + 1) / 2;
            if (to.type == SPLAT_PIXEL_U8) value = std::trunc(value * 255) / 255;
        }
        api::fill_interleaved(to, values.data());
        return {};
    });
}

splat_result splat_planes_from_depth(const splat_image* depth, const splat_image* normal,
                                     const splat_normals_desc* camera,
                                     const splat_planes_desc* desc, const splat_image* plane,
                                     uint32_t* count) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const api::ImageView from, api::image_to_read(depth, "depth"));
        SPLAT_TRY(api::check_image_size(from, "depth", from.width, from.height, 1));
        if (camera == nullptr) return invalid("camera is NULL, expected a splat_normals_desc");
        SPLAT_TRY(api::check_desc(camera, 0));
        SPLAT_TRY(check_normals_desc(*camera));
        prior_scores::PlaneRules rules;
        bool vectors = false;
        if (desc != nullptr) {
            SPLAT_TRY(api::check_desc(desc, SPLAT_NORMAL_VECTORS));
            vectors = desc->flags != 0;
            rules.degrees = value_or(desc->max_degrees, rules.degrees);
            rules.offset = value_or(desc->max_offset, rules.offset);
            rules.least = value_or(desc->least_share, rules.least);
        }
        SPLAT_ASSIGN(const api::ImageView to, api::image_to_fill(plane, "plane"));
        SPLAT_TRY(api::check_image_size(to, "plane", from.width, from.height, 4));
        if (vectors && to.type == SPLAT_PIXEL_U8)
            return invalid("plane has bytes, expected F16 or F32 with SPLAT_NORMAL_VECTORS");
        SPLAT_ASSIGN(std::vector<float> distances, distances_in(from, *camera));
        const std::vector<float> given = api::interleaved_of(from);
        for (std::size_t i = 0; i < distances.size(); ++i)
            if (!std::isfinite(distances[i]) || given[i] == 0) distances[i] = 0;
        const prior_models::DepthCamera seen_by = camera_of(from, *camera);
        SPLAT_ASSIGN(const std::vector<float> normals,
                     normals_in(normal, vectors, distances, seen_by));
        scene::Camera pinhole;
        SPLAT_COPY(pinhole, seen_by, width, height);
        pinhole.fx = seen_by.focal_x;
        pinhole.fy = seen_by.focal_y;
        pinhole.cx = seen_by.center_x;
        pinhole.cy = seen_by.center_y;
        SPLAT_ASSIGN(const prior_scores::PlaneMap map,
                     prior_scores::find_planes(distances, normals, pinhole, rules));
        api::fill_interleaved(to, numbers_of(map, !vectors).data());
        if (count != nullptr) *count = static_cast<std::uint32_t>(map.planes.size());
        return {};
    });
}
