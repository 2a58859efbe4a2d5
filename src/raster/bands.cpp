#include "raster/bands.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "raster_constants.h"
#include "scene/activate.h"
#include "scene/arrays.h"
#include "scene/vector.h"

namespace splat::raster {
namespace {

using scene::Mat3;
using scene::Vec3;

/// A camera as the kernels have it.
struct BandCamera {
    Mat3 rotation;  ///< columns of it are rows of the camera's
    Vec3 shift;
    std::array<double, 2> focal, centre;
    /// |x/z| and |y/z| of the Jacobian at least, where its limits exclude 0.
    std::array<double, 2> steepest;
    double turn;  ///< bound of the rotation's norm
};

/// Bound of the norm of a matrix that should be a rotation, of which `error` tells how far it is from one.
double norm_bound(double error, double norm) {
    return error < 1e-3 ? 1.001 : norm;
}

BandCamera camera_of(const PackedViews& views) {
    const auto at = [&](int quad, int k) {
        return static_cast<double>(views.cameras[static_cast<std::size_t>(4 * quad + k)]);
    };
    BandCamera camera{};
    for (int row = 0; row < 3; ++row) {
        camera.rotation[row] = {at(row, 0), at(row, 1), at(row, 2)};
        camera.shift[row] = at(row, 3);
    }
    for (int axis = 0; axis < 2; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        camera.focal[i] = at(3, axis);
        camera.centre[i] = at(3, 2 + axis);
        camera.steepest[i] = std::max({0.0, at(4, 2 * axis), -at(4, 2 * axis + 1)});
    }
    double error = 0, squares = 0;
    const Mat3 product = glm::transpose(camera.rotation) * camera.rotation;
    for (int i = 0; i < 3; ++i) {
        squares += glm::dot(camera.rotation[i], camera.rotation[i]);
        for (int k = 0; k < 3; ++k)
            error = std::max(error, std::abs(product[i][k] - (i == k ? 1 : 0)));
    }
    camera.turn = norm_bound(error, std::sqrt(squares));
    return camera;
}

/// Relative error of a sum of products in float32, at most.
constexpr double kRounding = 1e-5;
/// Standard deviations at which a Gaussian ends, with room for those to be rounded: more than all conventions'.
constexpr double kSigmas = 3.5;
static_assert(kSigmas > 1.05 * static_cast<double>(kMaxSigma) && kMaxSigma > kSigma3dgs);
/// Pixels^2 that are added to a variance: kDilation, and sqrt(kLambdaFloor), where eigenvalues are equal.
constexpr double kVariance = 0.62;
constexpr double kRootOfFloor = kVariance - static_cast<double>(kDilation);
static_assert(kRootOfFloor * kRootOfFloor > static_cast<double>(kLambdaFloor));
/// A radius is rounded up to whole pixels, and places lie half a pixel aside; the rest is for rounding.
constexpr double kPixels = 1.6;

/// Bound of the norm of the matrix that the formula for unit quaternions makes of Gaussian i: of one of length n it is
/// I + n^2 (R - I).
double turn_of(const scene::Gaussians& g, std::size_t i) {
    const double length = scene::length_of(scene::rotation_at(g, i));
    return norm_bound(std::abs(length - 1), 1 + 2 * length * length);
}

bool is_finite(const scene::Gaussians& g, std::size_t i) {
    // Finite if all are: float32 has 128 binary orders, double 1024.
    auto sum = static_cast<double>(g.opacity_logits[i]);
    for (std::size_t k = 0; k < 3; ++k)
        sum +=
            static_cast<double>(g.means[3 * i + k]) + static_cast<double>(g.log_scales[3 * i + k]);
    for (std::size_t k = 0; k < 4; ++k) sum += static_cast<double>(g.rotations[4 * i + k]);
    return std::isfinite(sum);
}

using Interval = std::array<double, 2>;
constexpr Interval kAll = {-HUGE_VAL, HUGE_VAL};
constexpr Interval kNone = {HUGE_VAL, -HUGE_VAL};

/// The same for the convention ray_maximum: what is seen lies in a sphere around the mean, beyond the near plane.
std::array<Interval, 2> ray_extent(const BandCamera& camera, const Vec3& m, const Vec3& error,
                                   double radius, double near_plane) {
    const double first = m.z - error.z - radius, last = m.z + error.z + radius;
    if (!(first > near_plane) || !std::isfinite(last)) return {kAll, kAll};
    std::array<Interval, 2> found{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto k = static_cast<int>(axis);
        const double low = m[k] - error[k] - radius, high = m[k] + error[k] + radius;
        const double margin = kPixels + kRounding * std::abs(camera.centre[axis]);
        found[axis] = {
            camera.focal[axis] * low / (low < 0 ? first : last) + camera.centre[axis] - margin,
            camera.focal[axis] * high / (high > 0 ? first : last) + camera.centre[axis] + margin};
    }
    return found;
}

/// The columns and rows of pixels that Gaussian i may reach. No covariance in the image has a larger eigenvalue than
/// (norm of the Jacobian * largest scale)^2 + kVariance. What is not finite is everywhere, to be counted.
std::array<Interval, 2> extent(const scene::Gaussians& g, std::size_t i, const BandCamera& camera,
                               const RasterDesc& desc) {
    const auto near_plane = static_cast<double>(desc.near_plane);
    if (!is_finite(g, i)) return {kAll, kAll};
    if (scene::opacity_of(static_cast<double>(g.opacity_logits[i])) < 0.999 * scene::kLeastOpacity)
        return {kNone, kNone};
    const Vec3 mean = glm::make_vec3(&g.means[3 * i]);
    Vec3 m, error;
    for (int row = 0; row < 3; ++row) {
        const Vec3& r = camera.rotation[row];
        m[row] = glm::dot(r, mean) + camera.shift[row];
        error[row] =
            kRounding * (glm::dot(glm::abs(r), glm::abs(mean)) + std::abs(camera.shift[row]));
    }
    if (m.z + error.z < near_plane * (1 - kRounding)) return {kNone, kNone};
    const double z = m.z - error.z;
    if (!(z > 0)) return {kAll, kAll};
    const float* const s = &g.log_scales[3 * i];
    const double scale = std::exp(static_cast<double>(std::max({s[0], s[1], s[2]})));
    if (desc.rays()) {
        const double deviation = std::sqrt(scale * scale + static_cast<double>(kRayVariance));
        return ray_extent(camera, m, error, kSigmas * camera.turn * 1.001 * deviation, near_plane);
    }
    std::array<double, 2> slope{}, norm{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto k = static_cast<int>(axis);
        slope[axis] = std::max((std::abs(m[k]) + error[k]) / z, camera.steepest[axis]);
        norm[axis] = camera.focal[axis] * std::hypot(1, slope[axis]) / z;
    }
    const double variance =
        std::pow(scale * camera.turn * turn_of(g, i), 2) * (norm[0] * norm[0] + norm[1] * norm[1]) +
        kVariance;
    std::array<Interval, 2> found{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto k = static_cast<int>(axis);
        const double middle = camera.focal[axis] * m[k] / m.z + camera.centre[axis];
        const double rounding = camera.focal[axis] * (error[k] + slope[axis] * error.z) / z +
                                kRounding * std::abs(camera.centre[axis]);
        const double radius = kSigmas * std::sqrt(variance) + kPixels + rounding;
        found[axis] = {middle - radius, middle + radius};
        if (!std::isfinite(radius) || !std::isfinite(middle)) found[axis] = kAll;
    }
    return found;
}

Bands::Reach reach_of(const std::array<Interval, 2>& extent, const RasterDesc& desc) {
    const auto& [columns, rows] = extent;
    if (!(columns[1] >= 0 && columns[0] <= desc.width && rows[1] >= 0 && rows[0] <= desc.height))
        return {};
    const double last = desc.tiles_y() - 1;
    const auto row = [last](double y) {
        return static_cast<std::uint16_t>(std::clamp(std::floor(y / kTileSize), 0.0, last));
    };
    return {row(rows[0]), static_cast<std::uint16_t>(row(rows[1]) + 1)};
}

}  // namespace

std::vector<std::size_t> Bands::gaussians_of(const Window& band) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < reaches.size(); ++i)
        if (reaches[i].begin < band.row_end && reaches[i].end > band.row_begin) found.push_back(i);
    return found;
}

Result<Bands> divide(const scene::Gaussians& scene, const RasterDesc& desc,
                     const PackedViews& views, std::uint64_t most) {
    SPLAT_ASSERT(views.count() == 1);
    const BandCamera camera = camera_of(views);
    Bands bands;
    bands.reaches.resize(scene.count());
    const std::uint32_t rows = desc.tiles_y();
    std::vector<std::uint64_t> begun(rows + 1), ended(rows + 1);  // before each row
    for (std::size_t i = 0; i < scene.count(); ++i) {
        const Bands::Reach reach = reach_of(extent(scene, i, camera, desc), desc);
        bands.reaches[i] = reach;
        if (reach.end == 0) continue;
        ++begun[reach.begin + std::size_t{1}];
        ++ended[reach.end];
    }
    for (std::size_t row = 0; row < rows; ++row) {
        begun[row + 1] += begun[row];
        ended[row + 1] += ended[row];
    }
    for (std::uint32_t begin = 0, end = 0; begin < rows; begin = end) {
        while (end < rows && begun[end + 1] - ended[begin] <= most) ++end;
        if (end == begin)
            return unsupported(
                "rasterizer: %llu Gaussians may reach one row of tiles, but the device takes at "
                "most "
                "%llu at a time: draw a smaller part of the scene, or a larger image",
                llu(begun[begin + 1] - ended[begin]), llu(most));
        bands.rows.push_back({begin, end});
    }
    return bands;
}

}  // namespace splat::raster
