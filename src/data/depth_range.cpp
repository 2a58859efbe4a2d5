#include "data/depth_range.h"

#include <algorithm>
#include <cmath>

#include "scene/camera_pose.h"

namespace splat::data {
namespace {

using scene::Mat3;
using scene::Vec3;

constexpr std::size_t kMostPoints = 4000;  ///< greatest number used of an object, evenly spread
constexpr std::uint32_t kMostObjects = 8;
/// A range is as good as the scene's if so much of the points is in it.
constexpr double kEnough = 0.95;
/// Least determinant of the equations of a place, divided by the cube of the number of views: about the mean squared
/// sine between the axes.
constexpr double kLeastTurn = 1e-4;

Vec3 center_of(const StoredView& view) {
    return scene::translation_of(view.camera_to_world);
}

Vec3 axis_of(const StoredView& view) {
    return scene::rotation_of(view.camera_to_world)[2];
}

double along_axis(const StoredView& view, const Vec3& point) {
    return glm::dot(point - center_of(view), axis_of(view));
}

/// The point nearest to the axes of all views, by least squares; false if they are nearly parallel.
bool find_place(const std::vector<StoredView>& views, Vec3& place) {
    Mat3 sum{};
    Vec3 right{};
    for (const StoredView& view : views) {
        const Vec3 axis = axis_of(view), center = center_of(view);
        const Mat3 across = Mat3(1) - glm::outerProduct(axis, axis);
        sum += across;
        for (std::size_t k = 0; k < 3; ++k) right += across[k] * center[k];
    }
    const auto count = static_cast<double>(views.size());
    if (!(glm::determinant(sum) > kLeastTurn * count * count * count)) return false;
    place = glm::inverse(sum) * right;
    return std::ranges::all_of(
        views, [&place](const StoredView& view) { return along_axis(view, place) > 0; });
}

DepthRange range_of_cameras(const std::vector<StoredView>& views, double source_distance) {
    DepthRange range;
    Vec3 place{};
    if (views.size() < 2 || !find_place(views, place)) return range;
    for (const StoredView& view : views) {
        const double from_origin = glm::length(center_of(view));
        const double scale =
            source_distance > 0 && from_origin > 0 ? source_distance / from_origin : 1;
        const double middle = scale * along_axis(view, place);
        const double radius = std::min(0.95 * middle, middle * 0.5 / view.focal_x);
        DepthRange own;
        own.known = true;
        own.near = middle - radius - view.origin_distance;
        own.far = middle + radius - view.origin_distance;
        // CO3D's objects lie around the origin, and are much smaller than what their photographs show.
        const double held = view.origin_distance > 0 ? radius : radius / 2;
        own.least_near = own.near + held;
        own.least_far = own.far - held;
        range.add(own);
    }
    return range;
}

/// Sets the ends to those of all but a hundredth of the depths at each.
void set_ends(DepthRange& range) {
    std::ranges::sort(range.depths);
    const auto at = [&range](double part) {
        return static_cast<double>(range.depths[static_cast<std::size_t>(
            part * static_cast<double>(range.depths.size() - 1))]);
    };
    range.near = at(0.01);
    range.far = at(0.99);
}

DepthRange range_of_points(const std::vector<StoredView>& views, const std::vector<Vec3>& points) {
    DepthRange range;
    const std::size_t step = points.size() / kMostPoints + 1;
    for (const StoredView& view : views) {
        const Mat3 axes = scene::rotation_of(view.camera_to_world);
        for (std::size_t i = 0; i < points.size(); i += step) {
            const Vec3 at = (points[i] - center_of(view)) * axes;
            const bool seen = at.z > 0 && std::abs(at.x) * view.focal_x <= 0.5 * at.z &&
                              std::abs(at.y) * view.focal_y <= 0.5 * at.z;
            if (seen) range.depths.push_back(static_cast<float>(at.z));
        }
    }
    range.known = range.by_points = !range.depths.empty();
    if (range.known) set_ends(range);
    return range;
}

/// The part of the sorted depths that lies in a range.
double part_within(const std::vector<float>& depths, double near, double far) {
    const auto first = std::ranges::lower_bound(depths, static_cast<float>(near));
    const auto last = std::upper_bound(first, depths.end(), static_cast<float>(far));
    return static_cast<double>(last - first) / static_cast<double>(depths.size());
}

std::string found_text(const DepthRange& range) {
    if (range.by_points)
        return format("98 %% of the COLMAP model's points in the views lie %.3g to %.3g away",
                      range.near, range.far);
    return format(
        "the cameras look at a place of which their images show what lies %.3g to %.3g away",
        range.near, range.far);
}

}  // namespace

void DepthRange::add(const DepthRange& other) {
    if (!other.known) return;
    if (!known || (other.by_points && !by_points)) {
        *this = other;
        return;
    }
    if (by_points != other.by_points) return;
    near = std::min(near, other.near);
    far = std::max(far, other.far);
    least_near = std::min(least_near, other.least_near);
    least_far = std::max(least_far, other.least_far);
    depths.insert(depths.end(), other.depths.begin(), other.depths.end());
    if (by_points) set_ends(*this);
}

Result<DepthRange> depth_range(const DatasetReader& reader, std::uint32_t object) {
    SPLAT_ASSIGN(const std::vector<StoredView> views, reader.cameras(object));
    SPLAT_ASSIGN(const std::vector<Vec3> points, reader.points(object));
    DepthRange range = range_of_points(views, points);
    return range.known ? range : range_of_cameras(views, reader.index().source_distance);
}

HoldingRange holding_range(const DepthRange& range) {
    const double margin = std::max(0.02 * (range.far - range.near), 0.01 * std::abs(range.far));
    const double least = range.near > 0 ? 0.5 * range.near : range.near - margin;
    return {std::max(range.near - margin, least), range.far + margin};
}

Result<std::string> depth_range_warning(const DatasetReader& reader, double znear, double zfar) {
    const auto count = static_cast<std::uint32_t>(reader.index().names.size());
    DepthRange range;
    const std::uint32_t looked_at = std::min(count, kMostObjects);
    for (std::uint32_t i = 0; i < looked_at; ++i) {
        SPLAT_ASSIGN(
            const DepthRange own,
            depth_range(reader, static_cast<std::uint32_t>(std::uint64_t{i} * count / looked_at)));
        range.add(own);
    }
    if (!range.known) return std::string();
    const double held = range.by_points ? part_within(range.depths, znear, zfar) : 0;
    const bool holds =
        range.by_points ? held >= kEnough : znear <= range.least_near && range.least_far <= zfar;
    if (holds) return std::string();
    const std::string found =
        range.by_points ? format(", of which they hold %.0f %%", 100 * held) : "";
    const HoldingRange holding = holding_range(range);
    return format(
        "data.znear %.4g to data.zfar %.4g cannot hold the scene: %s%s; set data.znear=%.3g and "
        "data.zfar=%.3g",
        znear, zfar, found_text(range).c_str(), found.c_str(), holding.znear, holding.zfar);
}

}  // namespace splat::data
