#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/vector.h"

namespace splat::scene {

/// A k-d tree: the exact distances to the nearest of many points, the same bits as those of a loop over all.
/// Thread-safe.
///
/// Source  Bentley 1975, doi:10.1145/361002.361007
class NearestPoints {
  public:
    /// At least one point and at most 2^32 - 1, all finite.
    explicit NearestPoints(std::span<const Vec3> points);

    [[nodiscard]] double squared_distance(const Vec3& from) const;

    /// Squared distances to the nearest points, as many as `least` takes, in ascending order; infinite beyond the
    /// number of points.
    void squared_distances(const Vec3& from, std::span<double> least) const;

  private:
    void build(std::size_t begin, std::size_t end);
    void search(std::size_t begin, std::size_t end, const Vec3& from,
                std::span<double> least) const;

    std::vector<Vec3> points_;        ///< the middle one of a range splits it
    std::vector<std::uint8_t> axes_;  ///< along which a point splits its range
};

/// |a - b|^2
inline double squared_distance(const Vec3& a, const Vec3& b) {
    const Vec3 d = a - b;
    return glm::dot(d, d);
}

}  // namespace splat::scene
