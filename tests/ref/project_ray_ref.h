#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "ref/project_box_ref.h"

/// Gaussians as the rays of pixels see them, without a projection: opacity at the maximum along the ray (Yu et al.
/// 2024, Gaussian Opacity Fields, arXiv:2404.10772).
///
///   W = S^-1 Rq^-1 R^-1, S^2 = scales^2 + kRayVariance      r = ((column + 1/2 - cx) / fx, (row + 1/2 - cy) / fy, 1)
///   |W (t r - m)|^2 is least at t = W r . W m / |W r|^2, the depth that the pixel sees if t > near
namespace splat::ref {

template <class Real>
struct RayMaximum {
    Real squared = 0;  ///< Mahalanobis distance, squared
    Real depth = 0;
};

template <class Real>
RayMaximum<Real> ray_maximum(const ProjectedGaussian<Real>& g, std::size_t column,
                             std::size_t row) {
    const RasterCamera<Real>& camera = g.ray.camera;
    const Vec3<Real> ray = {(static_cast<Real>(column) + Real(0.5) - camera.cx) / camera.fx,
                            (static_cast<Real>(row) + Real(0.5) - camera.cy) / camera.fy, Real(1)};
    const Vec3<Real> along = product(g.ray.whitening, ray);
    const Vec3<Real> mean = product(g.ray.whitening, g.camera_mean);
    RayMaximum<Real> found;
    found.depth = dot(along, mean) / dot(along, along);
    for (std::size_t k = 0; k < 3; ++k) {
        const Real off = found.depth * along[k] - mean[k];
        found.squared += off * off;
    }
    return found;
}

/// `axes`: R Rq S with the scales of the scene, from which W and the covariance follow.
template <class Real>
void project_ray(const RasterScene<Real>& scene, const CameraFrame<Real>& frame, std::size_t i,
                 ProjectedGaussian<Real>& g) {
    const Mat3<Real> turned = product(transposed(g.rotation), frame.inverse);
    const Mat3<Real> axes = product(frame.rotation, g.rotation);
    Mat3<Real> scaled = axes;
    for (std::size_t k = 0; k < 3; ++k) {
        const Real scale = scene.scales[3 * i + k];
        const Real deviation = std::sqrt(scale * scale + static_cast<Real>(raster::kRayVariance));
        for (std::size_t c = 0; c < 3; ++c) {
            g.ray.whitening[k][c] = turned[k][c] / deviation;
            scaled[c][k] *= deviation;
        }
    }
    g.ray.covariance = product(scaled, transposed(scaled));
    g.ray.camera = scene.camera;
    g.ray.near_plane = scene.options.near_plane;
    g.ray.used = true;
}

/// Least and greatest pixel coordinate, in one axis, of the points beyond the near plane with a squared distance of at
/// most `level`: where planes through the camera touch the ellipsoid, or where it ends in the near plane.
template <class Real>
std::array<Real, 2> ray_extent(const ProjectedGaussian<Real>& g, std::size_t axis, Real level) {
    const Mat3<Real>& sigma = g.ray.covariance;
    const Real near = g.ray.near_plane, z = g.camera_mean[2], x = g.camera_mean[axis];
    const Real xx = sigma[axis][axis], xz = sigma[axis][2], zz = sigma[2][2];
    const bool cut = z - std::sqrt(level * zz) < near;
    std::array<Real, 2> slopes{};
    if (cut) {
        const Real middle = x + xz / zz * (near - z);
        const Real half = std::sqrt((level - (near - z) * (near - z) / zz) * (xx - xz * xz / zz));
        slopes = {(middle - half) / near, (middle + half) / near};
    }
    // (x - slope z)^2 = level (1, -slope) sigma (1, -slope)^T
    const Real a = z * z - level * zz, b = x * z - level * xz, c = x * x - level * xx;
    const Real root = b * b - a * c;
    for (const Real sign : {Real(-1), Real(1)}) {
        if (!(root >= Real(0))) break;
        const Real slope = (b + sign * std::sqrt(root)) / a;
        const Real off = x - slope * z;
        const Real variance = xx - Real(2) * slope * xz + slope * slope * zz;
        const Real depth = z - off / variance * (xz - slope * zz);
        if (cut && !(depth >= near)) continue;
        slopes[off < Real(0) ? 1 : 0] = slope;
    }
    const Real focal = axis == 0 ? g.ray.camera.fx : g.ray.camera.fy;
    const Real centre = axis == 0 ? g.ray.camera.cx : g.ray.camera.cy;
    return {focal * slopes[0] + centre, focal * slopes[1] + centre};
}

/// Radii; false if the box misses the image.
template <class Real>
bool ray_box(const RasterScene<Real>& scene, ProjectedGaussian<Real>& g) {
    Real level = Real(2) * std::log(g.opacity / static_cast<Real>(raster::kAlphaMin));
    if (scene.options.cut_3_sigma) level = std::min(level, Real(9));
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto [least, most] = ray_extent(g, axis, level);
        const auto size = static_cast<Real>(axis == 0 ? scene.camera.width : scene.camera.height);
        if (!(most > Real(0)) || !(least < size)) return false;
        const Real largest(1U << 30U);
        const Real half = std::min(std::ceil((most - least) / Real(2)), largest);
        g.radius[axis] = static_cast<std::int64_t>(half);
    }
    return true;
}

}  // namespace splat::ref
