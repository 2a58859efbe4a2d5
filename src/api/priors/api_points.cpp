#include <cmath>
#include <shared_mutex>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "api/handles.h"
#include "api/scene/camera_value.h"
#include "core/os/path.h"
#include "io/file.h"
#include "io/mesh/mesh.h"
#include "io/ply_rows.h"
#include "prior_scores/point_scores.h"
#include "prior_scores/surface_points.h"
#include "scene/activate.h"
#include "scene/camera_pose.h"

using namespace splat;

namespace {

constexpr std::uint64_t kMaxMeshBytes = std::uint64_t{4} << 30;

using Points = std::vector<scene::Vec3>;

Status check_count_of_points(std::uint64_t count) {
    if (count % 3 == 0) return {};
    return invalid("count is %llu, expected 3 numbers for each point", llu(count));
}

void fill_points(const Points& from, float* to) {
    for (const scene::Vec3& point : from)
        for (std::size_t k = 0; k < 3; ++k) *to++ = static_cast<float>(point[k]);
}

/// Takes `count` points of a file in a folder: random ones of a mesh's surface, or evenly spaced ones of a point cloud.
Result<Points> points_of_file(io::Bytes file, const std::string& folder, std::size_t count,
                              std::uint64_t seed) {
    if (!io::is_ply(file)) {
        const io::MeshOptions options{.surface_only = true, .folder = folder};
        const std::string_view text = io::as_text(file);
        const bool is_gltf = text.starts_with("glTF") || text.starts_with('{');
        SPLAT_ASSIGN(const io::LoadedMesh loaded,
                     is_gltf ? io::read_gltf_mesh(file, options) : io::read_obj(file, options));
        return scene::sample_surface(loaded.mesh, count, seed);
    }
    SPLAT_ASSIGN(const Points cloud, io::read_ply_points(file));
    Points points(count);
    for (std::size_t i = 0; i < count; ++i) points[i] = cloud[i * cloud.size() / count];
    return points;
}

Points points_of(const float* numbers, std::uint64_t count) {
    Points points(count / 3);
    for (std::uint64_t i = 0; i < count; ++i)
        points[i / 3][i % 3] = static_cast<double>(numbers[i]);
    return points;
}

/// Means of the Gaussians that are at least so opaque. Errors: kInvalidArgument if there is none.
Result<Points> opaque_means(const scene::Gaussians& gaussians, double min_opacity) {
    Points means;
    for (std::size_t i = 0; i < gaussians.count(); ++i) {
        const auto logit = static_cast<double>(gaussians.opacity_logits[i]);
        if (std::isnan(logit)) return invalid("the opacity of Gaussian %zu is not a number", i);
        if (scene::opacity_of(logit) < min_opacity) continue;
        const float* const mean = &gaussians.means[3 * i];
        means.push_back({static_cast<double>(mean[0]), static_cast<double>(mean[1]),
                         static_cast<double>(mean[2])});
    }
    if (!means.empty()) return means;
    return invalid("none of the scene's %zu Gaussians has an opacity of %g (min_opacity) or more",
                   gaussians.count(), min_opacity);
}

}  // namespace

splat_result splat_points_from_mesh(const char* path, uint64_t seed, float* points,
                                    uint64_t count) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path", points, "points"));
        SPLAT_TRY(check_count_of_points(count));
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxMeshBytes));
        const std::string folder = os::text_of(os::path_of(path).parent_path());
        const auto made = points_of_file(file, folder.empty() ? "." : folder, count / 3, seed);
        if (!made.ok())
            return Status(made.status().code(),
                          "'" + std::string(path) + "': " + made.status().message());
        fill_points(made.value(), points);
        return {};
    });
}

splat_result splat_points_from_depth(const splat_image* depth, const splat_camera* camera,
                                     float* points, uint64_t capacity, uint64_t* needed) {
    bool incomplete = false;
    const splat_result result = api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const api::ImageView view, api::image_to_read(depth, "depth"));
        SPLAT_TRY(api::require(camera, "camera"));
        const scene::Camera seen_by = api::camera_of(*camera, "camera");
        SPLAT_TRY(scene::check_camera(seen_by));
        SPLAT_TRY(api::check_image_size(view, "depth", seen_by.width, seen_by.height, 1));
        SPLAT_ASSIGN(const Points made,
                     prior_scores::points_of_depth(api::planes_of(view), seen_by));
        const std::uint64_t numbers = 3 * made.size();
        if (needed != nullptr) *needed = numbers;
        incomplete = numbers > 0 && (points == nullptr || capacity < numbers);
        if (!incomplete) fill_points(made, points);
        return {};
    });
    return result == SPLAT_OK && incomplete ? SPLAT_INCOMPLETE : result;
}

splat_result splat_scene_compare_points(splat_scene scene, double min_opacity, const float* points,
                                        uint64_t count, double threshold,
                                        splat_point_scores* scores) {
    return api::with(scene, [&](const auto& object) -> Status {
        if (!(min_opacity >= 0 && min_opacity <= 1))
            return invalid("min_opacity is %g, expected 0 to 1", min_opacity);
        SPLAT_TRY(api::require(points, "points"));
        SPLAT_TRY(check_count_of_points(count));
        SPLAT_TRY(api::check_fill(scores, "scores"));
        Points means;
        {
            const std::shared_lock lock(object->mutex);
            SPLAT_ASSIGN(means, opaque_means(object->gaussians, min_opacity));
        }
        SPLAT_ASSIGN(const prior_scores::PointScores made,
                     prior_scores::compare_points(means, points_of(points, count), threshold));
        splat_point_scores filled{};
        filled.gaussians = means.size();
        SPLAT_COPY(filled, made, accuracy, completeness, chamfer, chamfer_squared, precision,
                   recall, f_score);
        api::give(filled, scores);
        return {};
    });
}
