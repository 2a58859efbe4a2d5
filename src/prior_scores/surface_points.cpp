#include "prior_scores/surface_points.h"

#include <algorithm>
#include <cmath>

#include "core/rng.h"
#include "prior_scores/check_map.h"
#include "scene/camera_pose.h"

namespace splat::prior_scores {
namespace {

using scene::Vec3;

double unit(std::uint32_t word) {
    return static_cast<double>(word) * 0x1p-32;
}

/// a + u (b - a) + v (c - a)
Vec3 point_between(const Vec3& a, const Vec3& b, const Vec3& c, double u, double v) {
    return a + (u * (b - a) + v * (c - a));
}

/// The areas of all triangles up to each one.
std::vector<double> summed_areas(const io::Mesh& mesh) {
    std::vector<double> sums;
    sums.reserve(mesh.triangles.size());
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vec3& origin = mesh.vertices[a];
        sum += glm::length(glm::cross(mesh.vertices[b] - origin, mesh.vertices[c] - origin)) / 2;
        sums.push_back(sum);
    }
    return sums;
}

}  // namespace

Result<std::vector<Vec3>> sample_surface(const io::Mesh& mesh, std::size_t count,
                                         std::uint64_t seed) {
    const std::vector<double> sums = summed_areas(mesh);
    if (sums.empty()) return invalid("the mesh has no faces");
    if (!(sums.back() > 0) || !std::isfinite(sums.back()))
        return invalid("the mesh has an area of %g, expected more than 0", sums.back());
    std::vector<Vec3> points;
    points.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::array<std::uint32_t, 4> words =
            philox({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32U), 0, 0},
                   {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U)});
        // 53 bits choose the triangle: large meshes have more than 2^32 times their least one.
        const double place =
            (unit(words[0]) + unit(words[1] & 0xFFFFF800U) * 0x1p-32) * sums.back();
        const auto at = std::upper_bound(sums.begin(), sums.end() - 1, place) - sums.begin();
        const auto& [a, b, c] = mesh.triangles[static_cast<std::size_t>(at)];
        double u = unit(words[2]), v = unit(words[3]);
        if (u + v > 1) {  // the other half of the parallelogram
            u = 1 - u;
            v = 1 - v;
        }
        points.push_back(point_between(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], u, v));
    }
    return points;
}

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
