#include "scene/nearest_points.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace splat::scene {
namespace {

constexpr std::size_t kLeaf = 8;  ///< points; fewer are searched by a loop

std::uint8_t widest_axis(std::span<const Vec3> points) {
    Vec3 low = points[0], high = points[0];
    for (const Vec3& point : points) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    const Vec3 extent = high - low;
    const double* const sides = glm::value_ptr(extent);
    return static_cast<std::uint8_t>(std::max_element(sides, sides + 3) - sides);
}

/// Keep the least ones in order.
void insert(double distance, std::span<double> least) {
    std::size_t at = least.size();
    for (; at > 0 && distance < least[at - 1]; --at)
        if (at < least.size()) least[at] = least[at - 1];
    if (at < least.size()) least[at] = distance;
}

}  // namespace

NearestPoints::NearestPoints(std::span<const Vec3> points)
    : points_(points.begin(), points.end()), axes_(points.size()) {
    build(0, points_.size());
}

void NearestPoints::build(std::size_t begin, std::size_t end) {
    if (end - begin <= kLeaf) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const std::size_t axis = widest_axis(std::span(points_).subspan(begin, end - begin));
    const auto at = [&](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end),
                     [axis](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; });
    axes_[middle] = static_cast<std::uint8_t>(axis);
    build(begin, middle);
    build(middle + 1, end);
}

void NearestPoints::search(std::size_t begin, std::size_t end, const Vec3& from,
                           std::span<double> least) const {
    if (end - begin <= kLeaf) {
        for (std::size_t i = begin; i < end; ++i)
            insert(scene::squared_distance(points_[i], from), least);
        return;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    insert(scene::squared_distance(points_[middle], from), least);
    const double beyond = points_[middle][axes_[middle]] - from[axes_[middle]];
    const std::pair low(begin, middle), high(middle + 1, end);
    const auto& [near, far] = beyond > 0 ? std::tie(low, high) : std::tie(high, low);
    search(near.first, near.second, from, least);
    // Rounding keeps order, so no point on the other side is nearer than the plane.
    if (beyond * beyond < least.back()) search(far.first, far.second, from, least);
}

double NearestPoints::squared_distance(const Vec3& from) const {
    double least = 0;
    squared_distances(from, {&least, 1});
    return least;
}

void NearestPoints::squared_distances(const Vec3& from, std::span<double> least) const {
    std::fill(least.begin(), least.end(), std::numeric_limits<double>::infinity());
    search(0, points_.size(), from, least);
}

}  // namespace splat::scene
