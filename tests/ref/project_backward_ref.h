#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ref/blend_backward_ref.h"
#include "ref/project_ref.h"

/// Gradient of project_forward, from the gradients of its outputs that blending reads.
///
///   Q = [A, B; B, C] the conic, Gq = [gA, gB/2; gB/2, gC]:  dL/dcov = G = -Q Gq Q
///   compensation rho = sqrt(det0/det):  dL/dcov0 += rho grad_rho (cov0^-1 - Q) / 2, above the floor
///   cov0 = A A^T:  dL/dA = 2 G A
///   A = J W, W = R Rq S:  dL/dJ = dL/dA W^T,  dL/dW = J^T dL/dA
///   J00 = fx / z:  dL/dfx = dL/dJ00 / z - dL/dJ02 slope / z, and (dslope/dfx) dL/dslope where the clamp rests:
///   slope = (k - cx) / fx there (3dgs: k / fx).  Mean: dL/dfx = gu x / z, dL/dcx = gu
///   J02 = -fx slope / z:  dJ02/dz = fx slope / z^2, and -fx/z dslope where the clamp rests
///   W = R N, N = Rq S:  dL/dR = dL/dW N^T,  dL/dN = R^T dL/dW
///   dL/dscale_k = sum_r Rq[r,k] dL/dN[r,k],  dL/dRq = dL/dN S
///   color: dL/ddirection through the harmonics, (I - d d^T) / distance to the mean; the camera's
///   centre gets the negative.
///
/// The centre is the last column of the inverse V^-1 of the whole 4x4 matrix V = world_to_camera,
/// with all 16 entries free: dL/dV = -V^-T [grad_centre; 0] [centre; 1]^T on top of what goes
/// through m. A twist (v, w) moves V to (I + [w]x, v) V:  dL/dv = dL/dt,  dL/dw = sum over the
/// columns c of V of c x dL/dc.
namespace splat::ref {

template <class Real>
struct RasterBackward {
    std::vector<Real> grad_means;        ///< [n,3]
    std::vector<Real> grad_scales;       ///< [n,3]
    std::vector<Real> grad_rotations;    ///< [n,4]
    std::vector<Real> grad_opacities;    ///< [n]
    std::vector<Real> grad_sh;           ///< [n,sh_coefficients,3], empty with colors
    std::vector<Real> grad_colors;       ///< [n,3] of the color after its clamp
    std::vector<Real> grad_means2d;      ///< [n,2]
    std::vector<Real> grad_means2d_abs;  ///< [n,2]
    std::vector<Real> grad_conics;       ///< [n,3]
    std::array<Real, 16> grad_world_to_camera{};
    std::array<Real, 6> grad_twist{};       ///< translation, rotation
    std::array<Real, 4> grad_intrinsics{};  ///< fx, fy, cx, cy
};

/// Sums over all Gaussians, for the gradient of the camera.
template <class Real>
struct CameraBackward {
    Mat3<Real> rotation{};
    Vec3<Real> translation{};
    Vec3<Real> centre{};
    std::array<Real, 4> intrinsics{};
};

/// dL/dcov0 as a symmetric matrix {G00, G01, G11}.
template <class Real>
std::array<Real, 3> conic_backward(const RasterScene<Real>& scene, const ProjectedGaussian<Real>& g,
                                   const std::array<Real, 3>& grad_conic, Real grad_compensation) {
    const auto [A, B, C] = g.conic;
    const auto [gA, gB, gC] = grad_conic;
    const Real half = gB / Real(2);
    // Gq Q, then -Q (Gq Q).
    const Real m00 = gA * A + half * B;
    const Real m01 = gA * B + half * C;
    const Real m10 = half * A + gC * B;
    const Real m11 = half * B + gC * C;
    std::array<Real, 3> grad{-(A * m00 + B * m10), -(A * m01 + B * m11), -(B * m01 + C * m11)};
    if (scene.options.is_original()) {
        const Real squared = g.det * g.det;
        const Real factor = squared / (squared + static_cast<Real>(raster::kConicGradMin));
        for (Real& element : grad) element *= factor;
    }
    if (scene.options.antialiased && g.compensation > static_cast<Real>(raster::kCompensationMin)) {
        const auto dilation = static_cast<Real>(raster::kDilation);
        const Real scale = g.compensation * grad_compensation / Real(2);
        grad[0] += scale * ((g.cov[2] - dilation) / g.det0 - A);
        grad[1] += scale * (-g.cov[1] / g.det0 - B);
        grad[2] += scale * ((g.cov[0] - dilation) / g.det0 - C);
    }
    return grad;
}

/// From dL/dcov0 to dL/dW; adds what the Jacobian passes to the mean in camera coordinates.
template <class Real>
Mat3<Real> covariance_backward(const RasterScene<Real>& scene, const ProjectedGaussian<Real>& g,
                               const std::array<Real, 3>& grad_cov, Vec3<Real>& grad_m,
                               CameraBackward<Real>& camera) {
    const std::array<Real, 2> focal{scene.camera.fx, scene.camera.fy};
    const Real z = g.camera_mean[2];
    std::array<Vec3<Real>, 2> grad_rows{};
    for (std::size_t k = 0; k < 3; ++k) {
        grad_rows[0][k] = Real(2) * (grad_cov[0] * g.rows[0][k] + grad_cov[1] * g.rows[1][k]);
        grad_rows[1][k] = Real(2) * (grad_cov[1] * g.rows[0][k] + grad_cov[2] * g.rows[1][k]);
    }
    Mat3<Real> grad_axes{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const Real scale = focal[axis] / z;
        const Real slope = g.slope[axis];
        for (std::size_t k = 0; k < 3; ++k) {
            grad_axes[axis][k] += scale * grad_rows[axis][k];
            grad_axes[2][k] -= scale * slope * grad_rows[axis][k];
        }
        // The diagonal entry focal/z and the one of the last column, -focal slope / z.
        const Real grad_scale = dot(grad_rows[axis], g.camera_axes[axis]);
        const Real grad_last = dot(grad_rows[axis], g.camera_axes[2]);
        grad_m[2] -= scale / z * grad_scale;
        grad_m[2] += scale * slope / z * grad_last;
        const bool constant = g.clamped[axis];
        camera.intrinsics[axis] += (grad_scale - slope * grad_last) / z;
        if (constant) {
            camera.intrinsics[axis] += grad_last * slope / z;
            if (!scene.options.is_3dgs()) camera.intrinsics[2 + axis] += grad_last / z;
        }
        if (!constant) {
            grad_m[axis] -= scale / z * grad_last;
            grad_m[2] += scale * slope / z * grad_last;
        } else if (scene.options.is_original()) {
            grad_m[2] += scale * slope / z * grad_last;
        }
    }
    return grad_axes;
}

/// From dL/dmean2d to the mean in camera coordinates.
template <class Real>
void point_backward(const RasterScene<Real>& scene, const ProjectedGaussian<Real>& g, Real grad_u,
                    Real grad_v, Vec3<Real>& grad_m, CameraBackward<Real>& sums) {
    const RasterCamera<Real>& camera = scene.camera;
    const Real z = g.camera_mean[2];
    const std::array<Real, 2> focal{camera.fx, camera.fy};
    const std::array<Real, 2> offset{camera.cx - static_cast<Real>(camera.width) / Real(2),
                                     camera.cy - static_cast<Real>(camera.height) / Real(2)};
    const std::array<Real, 2> grad{grad_u, grad_v};
    const bool original = scene.options.is_3dgs();
    const Real w = original ? z + static_cast<Real>(raster::kHomogeneousMin) : z;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const Real position = focal[axis] * g.camera_mean[axis];
        sums.intrinsics[axis] += g.camera_mean[axis] / w * grad[axis];
        sums.intrinsics[2 + axis] += z / w * grad[axis];
        grad_m[axis] += focal[axis] / w * grad[axis];
        grad_m[2] -= position / (w * w) * grad[axis];
        if (original) grad_m[2] += offset[axis] * (w - z) / (w * w) * grad[axis];
    }
}

/// From dL/dW to scales, rotation and camera.
template <class Real>
void axes_backward(const RasterScene<Real>& scene, const CameraFrame<Real>& frame, std::size_t i,
                   const ProjectedGaussian<Real>& g, const Mat3<Real>& grad_axes,
                   RasterBackward<Real>& out, CameraBackward<Real>& camera) {
    Mat3<Real> scaled = g.rotation;
    for (Vec3<Real>& row : scaled)
        for (std::size_t k = 0; k < 3; ++k) row[k] *= scene.scales[3 * i + k];
    const Mat3<Real> grad_rotation = product(grad_axes, transposed(scaled));
    Mat3<Real> grad_scaled = product(transposed(frame.rotation), grad_axes);
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t k = 0; k < 3; ++k) {
            camera.rotation[r][k] += grad_rotation[r][k];
            out.grad_scales[3 * i + k] += g.rotation[r][k] * grad_scaled[r][k];
            grad_scaled[r][k] *= scene.scales[3 * i + k];
        }
    std::array<Real, 4> grad_q = quaternion_matrix_backward(g.quaternion, grad_scaled);
    if (!scene.options.is_3dgs()) {
        Real along(0);
        for (std::size_t k = 0; k < 4; ++k) along += grad_q[k] * g.quaternion[k];
        for (std::size_t k = 0; k < 4; ++k)
            grad_q[k] = (grad_q[k] - along * g.quaternion[k]) / g.quaternion_norm;
    }
    for (std::size_t k = 0; k < 4; ++k) out.grad_rotations[4 * i + k] += grad_q[k];
}

/// From dL/dcolor to the harmonics, the mean and the camera's centre.
template <class Real>
void color_backward(const RasterScene<Real>& scene, std::size_t i, const ProjectedGaussian<Real>& g,
                    Vec3<Real> grad_color, RasterBackward<Real>& out,
                    CameraBackward<Real>& camera) {
    if (!scene.colors.empty()) return;
    const auto basis = sh_basis(g.direction);
    const auto basis_gradient = sh_basis_gradient(g.direction);
    Vec3<Real> grad_direction{};
    for (std::size_t channel = 0; channel < 3; ++channel)
        if (g.color_clamped[channel]) grad_color[channel] = Real(0);
    for (std::size_t k = 0; k < scene.sh_coefficients; ++k) {
        const std::size_t row = i * scene.sh_coefficients + k;
        const Real along = dot(row3(scene.sh, row), grad_color);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            out.grad_sh[3 * row + axis] += basis[k] * grad_color[axis];
            grad_direction[axis] += basis_gradient[k][axis] * along;
        }
    }
    const Real radial = dot(g.direction, grad_direction);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Real grad = (grad_direction[axis] - radial * g.direction[axis]) / g.distance;
        out.grad_means[3 * i + axis] += grad;
        camera.centre[axis] -= grad;
    }
}

/// dL/dV and the twist.
template <class Real>
void camera_backward(const RasterScene<Real>& scene, const CameraFrame<Real>& frame,
                     const CameraBackward<Real>& camera, RasterBackward<Real>& out) {
    // V^-T [grad_centre; 0]: the inverse's first three rows are [rotation^-1, centre].
    const Vec3<Real> upper = product(transposed(frame.inverse), camera.centre);
    const std::array<Real, 4> left{upper[0], upper[1], upper[2], dot(frame.centre, camera.centre)};
    const std::array<Real, 4> right{frame.centre[0], frame.centre[1], frame.centre[2], Real(1)};
    std::array<Real, 16>& grad = out.grad_world_to_camera;
    for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t c = 0; c < 4; ++c) {
            grad[4 * r + c] = -left[r] * right[c];
            if (r < 3) grad[4 * r + c] += c < 3 ? camera.rotation[r][c] : camera.translation[r];
        }
    const auto& V = scene.camera.world_to_camera;
    for (std::size_t c = 0; c < 4; ++c) {
        const Vec3<Real> turned = cross(Vec3<Real>{V[c], V[4 + c], V[8 + c]},
                                        Vec3<Real>{grad[c], grad[4 + c], grad[8 + c]});
        for (std::size_t k = 0; k < 3; ++k) out.grad_twist[3 + k] += turned[k];
    }
    for (std::size_t k = 0; k < 3; ++k) out.grad_twist[k] = grad[4 * k + 3];
    out.grad_intrinsics = camera.intrinsics;
}

template <class Real>
RasterBackward<Real> project_backward(const RasterScene<Real>& scene,
                                      const ProjectForward<Real>& projected,
                                      const BlendBackward<Real>& blended) {
    const std::size_t n = scene.count();
    const CameraFrame<Real> frame(scene.camera);
    CameraBackward<Real> camera;
    RasterBackward<Real> out;
    out.grad_means.resize(3 * n);
    out.grad_scales.resize(3 * n);
    out.grad_rotations.resize(4 * n);
    out.grad_opacities.resize(n);
    out.grad_sh.resize(scene.sh.size());
    out.grad_colors = blended.grad_colors;
    out.grad_means2d = blended.grad_means2d;
    out.grad_means2d_abs = blended.grad_means2d_abs;
    out.grad_conics = blended.grad_conics;
    for (const std::size_t i : projected.order) {
        const ProjectedGaussian<Real>& g = projected.gaussians[i];
        Vec3<Real> grad_m{Real(0), Real(0), blended.grad_depths[i]};
        const Real grad_opacity = blended.grad_opacities[i];
        out.grad_opacities[i] = g.compensation * grad_opacity;
        const std::array<Real, 3> grad_cov = conic_backward(scene, g, row3(blended.grad_conics, i),
                                                            scene.opacities[i] * grad_opacity);
        const Mat3<Real> grad_axes = covariance_backward(scene, g, grad_cov, grad_m, camera);
        axes_backward(scene, frame, i, g, grad_axes, out, camera);
        point_backward(scene, g, blended.grad_means2d[2 * i], blended.grad_means2d[2 * i + 1],
                       grad_m, camera);
        color_backward(scene, i, g, row3(blended.grad_colors, i), out, camera);
        const Vec3<Real> mean = row3(scene.means, i);
        add_row3(out.grad_means, i, product(transposed(frame.rotation), grad_m));
        for (std::size_t r = 0; r < 3; ++r) {
            camera.translation[r] += grad_m[r];
            for (std::size_t c = 0; c < 3; ++c) camera.rotation[r][c] += grad_m[r] * mean[c];
        }
    }
    camera_backward(scene, frame, camera, out);
    return out;
}

}  // namespace splat::ref
