#include "prior_models/depth_normals.h"

#include <algorithm>
#include <cmath>

#include "scene/vector.h"

namespace splat::prior_models {
namespace {

using scene::Vec3;

/// A depth map with its points.
class DepthPoints {
  public:
    DepthPoints(std::span<const float> depth, const DepthCamera& camera)
        : depth_(depth), camera_(camera) {}

    [[nodiscard]] bool has(std::int64_t x, std::int64_t y) const {
        return x >= 0 && y >= 0 && x < camera_.width && y < camera_.height && z(x, y) > 0 &&
               std::isfinite(z(x, y));
    }

    /// The difference of the points of two neighbours in a direction: from or to (x, y), whichever is nearer in
    /// depth; 0 without both.
    [[nodiscard]] Vec3 difference(std::int64_t x, std::int64_t y, std::int64_t dx,
                                  std::int64_t dy) const {
        const bool ahead = has(x + dx, y + dy), behind = has(x - dx, y - dy);
        if (!ahead && !behind) return {};
        const bool forward = ahead && (!behind || std::abs(z(x + dx, y + dy) - z(x, y)) <=
                                                      std::abs(z(x - dx, y - dy) - z(x, y)));
        return forward ? point(x + dx, y + dy) - point(x, y) : point(x, y) - point(x - dx, y - dy);
    }

  private:
    [[nodiscard]] double z(std::int64_t x, std::int64_t y) const {
        return static_cast<double>(depth_[static_cast<std::size_t>(y * camera_.width + x)]);
    }
    [[nodiscard]] Vec3 point(std::int64_t x, std::int64_t y) const {
        const double depth = z(x, y);
        return {depth * (static_cast<double>(x) + 0.5 - camera_.center_x) / camera_.focal_x,
                depth * (static_cast<double>(y) + 0.5 - camera_.center_y) / camera_.focal_y, depth};
    }

    std::span<const float> depth_;
    const DepthCamera& camera_;
};

}  // namespace

std::vector<float> normals_of(std::span<const float> depth, const DepthCamera& camera) {
    const DepthPoints points(depth, camera);
    std::vector<float> normals(3 * depth.size());
    for (std::int64_t y = 0; y < camera.height; ++y)
        for (std::int64_t x = 0; x < camera.width; ++x) {
            if (!points.has(x, y)) continue;
            const Vec3 a = points.difference(x, y, 1, 0), b = points.difference(x, y, 0, 1);
            const Vec3 n = glm::cross(b, a);
            const double length = glm::length(n);
            if (!(length > 0)) continue;
            const glm::vec3 unit = n / length;
            std::copy_n(glm::value_ptr(unit), 3,
                        normals.begin() + static_cast<std::ptrdiff_t>(3 * (y * camera.width + x)));
        }
    return normals;
}

void distances_of(std::vector<float>& depth, double nearest, double farthest) {
    for (float& value : depth)
        value = static_cast<float>(
            1 / (1 / farthest + static_cast<double>(value) * (1 / nearest - 1 / farthest)));
}

}  // namespace splat::prior_models
