#include "prior_scores/nearest_points.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace splat::prior_scores {
namespace {

constexpr std::size_t kLeaf = 8;  ///< points; fewer are searched by a loop

std::uint8_t widest_axis(std::span<const scene::Vec3> points) {
    scene::Vec3 low = points[0], high = points[0];
    for (const scene::Vec3& point : points) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    const scene::Vec3 extent = high - low;
    const double* const sides = glm::value_ptr(extent);
    return static_cast<std::uint8_t>(std::max_element(sides, sides + 3) - sides);
}

}  // namespace

NearestPoints::NearestPoints(std::span<const scene::Vec3> points)
    : points_(points.begin(), points.end()), axes_(points.size()) {
    build(0, points_.size());
}

void NearestPoints::build(std::size_t begin, std::size_t end) {
    if (end - begin <= kLeaf) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const std::size_t axis = widest_axis(std::span(points_).subspan(begin, end - begin));
    const auto at = [&](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(
        at(begin), at(middle), at(end),
        [axis](const scene::Vec3& a, const scene::Vec3& b) { return a[axis] < b[axis]; });
    axes_[middle] = static_cast<std::uint8_t>(axis);
    build(begin, middle);
    build(middle + 1, end);
}

void NearestPoints::search(std::size_t begin, std::size_t end, const scene::Vec3& from,
                           double& least) const {
    if (end - begin <= kLeaf) {
        for (std::size_t i = begin; i < end; ++i)
            least = std::min(least, prior_scores::squared_distance(points_[i], from));
        return;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    least = std::min(least, prior_scores::squared_distance(points_[middle], from));
    const double beyond = points_[middle][axes_[middle]] - from[axes_[middle]];
    const std::pair low(begin, middle), high(middle + 1, end);
    const auto& [near, far] = beyond > 0 ? std::tie(low, high) : std::tie(high, low);
    search(near.first, near.second, from, least);
    // Rounding keeps order, so no point on the other side is nearer than the plane.
    if (beyond * beyond < least) search(far.first, far.second, from, least);
}

double NearestPoints::squared_distance(const scene::Vec3& from) const {
    double least = std::numeric_limits<double>::infinity();
    search(0, points_.size(), from, least);
    return least;
}

}  // namespace splat::prior_scores
