#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "ref/project_box_ref.h"
#include "ref/project_ray_ref.h"
#include "ref/raster_scene_ref.h"
#include "ref/sh_ref.h"

/// From 3D Gaussians to ellipses in the image (Zwicker et al. 2001, EWA splatting; Kerbl et al.
/// 2023, arXiv:2308.04079).
///
/// With world_to_camera = (R, t), Rq the matrix of the rotation and S = diag(scales):
///
///   m = R mean + t = (x, y, z)      A = J R Rq S, 2x3, with rows v1 and v2
///   J = [fx/z, 0, -fx tx/z^2; 0, fy/z, -fy ty/z^2]      tx = z clamp(x/z), ty = z clamp(y/z)
///   cov0 = A A^T = [a0, b; b, c0]      cov = cov0 + dilation I = [a, b; b, c]
///   conic = (c, -b, a) / det      sigma = (conic0 dx^2 + conic2 dy^2) / 2 + conic1 dx dy
///
/// Determinants by Cauchy-Binet: det0 = |v1 x v2|^2, det = det0 + dilation (a0 + c0) + dilation^2.
/// No term is negative, where a c - b^2 cancels for needles.
///
/// Antialiased (Yu et al. 2024, arXiv:2311.16493): opacity max(kCompensationMin, sqrt(det0 / det)).
///
/// Policy: a Gaussian is absent - radius 0, all results 0, no gradient - if any of its numbers is not finite, if
/// its rotation is shorter than kQuaternionMin, its opacity is not positive, or its projected
/// covariance or determinant has no float32 value. So is one that its convention culls.
namespace splat::ref {

template <class Real>
bool is_absent(const RasterScene<Real>& scene, std::size_t i) {
    Real squared(0);
    for (std::size_t k = 0; k < 4; ++k)
        squared += scene.rotations[4 * i + k] * scene.rotations[4 * i + k];
    bool finite = std::isfinite(scene.opacities[i]) && std::isfinite(squared);
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
        finite = finite && std::isfinite(scene.means[k]) && std::isfinite(scene.scales[k]);
        finite = finite && (scene.colors.empty() || std::isfinite(scene.colors[k]));
    }
    const std::size_t numbers = scene.colors.empty() ? 3 * scene.sh_coefficients : 0;
    for (std::size_t k = i * numbers; k < (i + 1) * numbers; ++k)
        finite = finite && std::isfinite(scene.sh[k]);
    const auto shortest = static_cast<Real>(raster::kQuaternionMin);
    return !finite || !(squared >= shortest * shortest) || !(scene.opacities[i] > Real(0));
}

/// Where the ray x/z (axis 0) or y/z (axis 1) is clamped in the Jacobian.
template <class Real>
std::array<Real, 2> slope_limits(const RasterScene<Real>& scene, std::size_t axis) {
    const RasterCamera<Real>& camera = scene.camera;
    const Real focal = axis == 0 ? camera.fx : camera.fy;
    const Real centre = axis == 0 ? camera.cx : camera.cy;
    const auto size = static_cast<Real>(axis == 0 ? camera.width : camera.height);
    const Real half_field = size / (Real(2) * focal);
    if (scene.options.is_3dgs()) {
        const Real limit = static_cast<Real>(raster::kFovMargin3dgs) * half_field;
        return {-limit, limit};
    }
    const Real margin = static_cast<Real>(raster::kFovMarginGsplat) * half_field;
    return {-(centre / focal + margin), (size - centre) / focal + margin};
}

/// Pixel of a point in camera coordinates. 3dgs divides by z + kHomogeneousMin in clip
/// coordinates, whose origin is the middle of the image.
template <class Real>
std::array<Real, 2> project_point(const RasterScene<Real>& scene, const Vec3<Real>& m) {
    const RasterCamera<Real>& camera = scene.camera;
    if (!scene.options.is_3dgs())
        return {camera.fx * m[0] / m[2] + camera.cx, camera.fy * m[1] / m[2] + camera.cy};
    const Real half_width = static_cast<Real>(camera.width) / Real(2);
    const Real half_height = static_cast<Real>(camera.height) / Real(2);
    const Real w = m[2] + static_cast<Real>(raster::kHomogeneousMin);
    return {(camera.fx * m[0] + (camera.cx - half_width) * m[2]) / w + half_width,
            (camera.fy * m[1] + (camera.cy - half_height) * m[2]) / w + half_height};
}

/// cov, determinants, conic.
template <class Real>
void project_covariance(const RasterScene<Real>& scene, const CameraFrame<Real>& frame,
                        std::size_t i, ProjectedGaussian<Real>& g) {
    const Vec3<Real>& m = g.camera_mean;
    const std::array<Real, 2> focal{scene.camera.fx, scene.camera.fy};
    g.rotation = quaternion_matrix(g.quaternion);
    g.camera_axes = product(frame.rotation, g.rotation);
    for (Vec3<Real>& row : g.camera_axes)
        for (std::size_t k = 0; k < 3; ++k) row[k] *= scene.scales[3 * i + k];
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto [least, most] = slope_limits(scene, axis);
        const Real slope = m[axis] / m[2];
        g.slope[axis] = std::min(std::max(slope, least), most);
        g.clamped[axis] = slope < least || slope > most;
        for (std::size_t k = 0; k < 3; ++k)
            g.rows[axis][k] =
                focal[axis] / m[2] * (g.camera_axes[axis][k] - g.slope[axis] * g.camera_axes[2][k]);
    }
    const auto dilation = static_cast<Real>(raster::kDilation);
    const Real a0 = dot(g.rows[0], g.rows[0]);
    const Real c0 = dot(g.rows[1], g.rows[1]);
    const Vec3<Real> normal = cross(g.rows[0], g.rows[1]);
    g.cov = {a0 + dilation, dot(g.rows[0], g.rows[1]), c0 + dilation};
    g.det0 = dot(normal, normal);
    g.det = g.det0 + dilation * (a0 + c0) + dilation * dilation;
    g.conic = {g.cov[2] / g.det, -g.cov[1] / g.det, g.cov[0] / g.det};
}

template <class Real>
void project_color(const RasterScene<Real>& scene, const CameraFrame<Real>& frame, std::size_t i,
                   ProjectedGaussian<Real>& g) {
    const Vec3<Real> mean = row3(scene.means, i);
    for (std::size_t k = 0; k < 3; ++k) g.direction[k] = mean[k] - frame.centre[k];
    g.distance = std::sqrt(dot(g.direction, g.direction));
    for (Real& element : g.direction) element /= g.distance;
    if (!scene.colors.empty()) {
        g.color = row3(scene.colors, i);
        return;
    }
    const auto basis = sh_basis(g.direction);
    for (std::size_t channel = 0; channel < 3; ++channel) {
        auto sum = static_cast<Real>(raster::kShOffset);
        for (std::size_t k = 0; k < scene.sh_coefficients; ++k)
            sum += basis[k] * scene.sh[3 * (i * scene.sh_coefficients + k) + channel];
        g.color_clamped[channel] = sum < Real(0);
        g.color[channel] = std::max(Real(0), sum);
    }
}

/// Normal of a flat Gaussian: its axis of least scale (the first of equals), in camera
/// coordinates, pointing to the camera's side.
template <class Real>
Vec3<Real> project_normal(const RasterScene<Real>& scene, const CameraFrame<Real>& frame,
                          std::size_t i, const ProjectedGaussian<Real>& g) {
    const Vec3<Real> scales = row3(scene.scales, i);
    const auto axis =
        static_cast<std::size_t>(std::min_element(scales.begin(), scales.end()) - scales.begin());
    Vec3<Real> normal = product(frame.rotation, transposed(g.rotation)[axis]);
    const Real length = std::sqrt(dot(normal, normal));
    const Real sign = dot(normal, g.camera_mean) > Real(0) ? Real(-1) : Real(1);
    for (Real& element : normal) element *= sign / length;
    return normal;
}

template <class Real>
ProjectedGaussian<Real> project_gaussian(const RasterScene<Real>& scene,
                                         const CameraFrame<Real>& frame, std::size_t i) {
    ProjectedGaussian<Real> g;
    const RasterOptions<Real>& options = scene.options;
    if (is_absent(scene, i)) return {};
    g.camera_mean = product(frame.rotation, row3(scene.means, i));
    for (std::size_t k = 0; k < 3; ++k) g.camera_mean[k] += frame.translation[k];
    g.depth = g.camera_mean[2];
    const bool near_enough = options.is_gsplat()
                                 ? g.depth >= options.near_plane && g.depth <= options.far_plane
                                 : g.depth > options.near_plane;
    if (!near_enough) return {};
    Real squared(0);
    for (std::size_t k = 0; k < 4; ++k) {
        g.quaternion[k] = scene.rotations[4 * i + k];
        squared += g.quaternion[k] * g.quaternion[k];
    }
    g.quaternion_norm = std::sqrt(squared);
    if (!options.is_3dgs())
        for (Real& element : g.quaternion) element /= g.quaternion_norm;
    g.mean2d = project_point(scene, g.camera_mean);
    project_covariance(scene, frame, i, g);
    if (options.is_ray())
        project_ray(scene, frame, i, g);
    else if (!std::isfinite(static_cast<float>(g.det)) || !(g.det > Real(0)))
        return {};
    g.compensation = Real(1);
    if (options.antialiased)
        g.compensation =
            std::max(static_cast<Real>(raster::kCompensationMin), std::sqrt(g.det0 / g.det));
    g.opacity = scene.opacities[i] * g.compensation;
    if (!options.is_3dgs() && g.opacity < static_cast<Real>(raster::kAlphaMin)) return {};
    if (!(options.is_ray() ? ray_box(scene, g) : project_box(scene, g))) return {};
    g.reach = std::log(g.opacity / static_cast<Real>(raster::kAlphaMin)) + Real(1e-3);
    if (options.cut_3_sigma) g.reach = std::min(g.reach, Real(4.5));
    g.valid = true;
    project_color(scene, frame, i, g);
    g.normal = project_normal(scene, frame, i, g);
    return g;
}

/// What Gaussians are blended by, the least first.
template <class Real>
Real order_key(const RasterScene<Real>& scene, const ProjectedGaussian<Real>& g) {
    return scene.options.sort_by_distance ? g.distance : g.depth;
}

template <class Real>
ProjectForward<Real> project_forward(const RasterScene<Real>& scene) {
    ProjectForward<Real> out;
    const CameraFrame<Real> frame(scene.camera);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        out.gaussians.push_back(project_gaussian(scene, frame, i));
        if (out.gaussians.back().valid) out.order.push_back(static_cast<std::uint32_t>(i));
    }
    const auto key = [&](std::uint32_t i) {
        return static_cast<float>(order_key(scene, out.gaussians[i]));
    };
    std::stable_sort(out.order.begin(), out.order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    return out;
}

}  // namespace splat::ref
