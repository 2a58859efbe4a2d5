#include "prior_scores/surface_points.h"

#include "prior_scores/check_map.h"
#include "scene/camera_pose.h"

namespace splat::prior_scores {

using scene::Vec3;

Result<std::vector<Vec3>> points_of_depth(std::span<const float> depth,
                                          const scene::Camera& camera) {
    SPLAT_TRY(check_map(depth, std::size_t{camera.height} * camera.width, "the depth"));
    const scene::Mat3 turn = scene::rotation_of(camera.world_to_camera);
    const Vec3 eye = scene::camera_center(camera);
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const auto z = static_cast<double>(depth[i]);
        if (!(z > 0)) continue;
        const Vec3 seen = {
            (static_cast<double>(i % camera.width) + 0.5 - camera.cx) / camera.fx * z,
            (static_cast<double>(i / camera.width) + 0.5 - camera.cy) / camera.fy * z, z};
        points.push_back(eye + seen * turn);
    }
    return points;
}

}  // namespace splat::prior_scores
