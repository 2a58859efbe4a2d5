#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "raster_constants.h"

/// The inputs of the rasterizer, and the small vectors and matrices of its reference.
///
/// Real is double for the reference itself, float to see what float32 costs.
namespace splat::ref {

/// The published rasterizer whose semantics are followed in every detail.
enum class Convention { k3dgs, kGsplat, kRayMaximum };

/// kTrue: the derivative of the forward pass. kOriginal (3dgs only): as the published code has it,
/// with three deviations: the clamp of alpha passes its gradient straight through, tx is held
/// constant where the field-of-view clamp acts, and det^2 + 1e-7 divides the conic's gradient.
enum class RasterGradient { kTrue, kOriginal };

/// Pinhole, OpenCV axes; the centre of the pixel in column i and row j is (i + 0.5, j + 0.5) in
/// both conventions.
template <class Real>
struct RasterCamera {
    Real fx = 1, fy = 1, cx = 0, cy = 0;  ///< pixels
    std::size_t width = 1;
    std::size_t height = 1;
    std::array<Real, 16> world_to_camera{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
};

template <class Real>
struct RasterOptions {
    Convention convention = Convention::kGsplat;
    bool antialiased = false;       ///< gsplat: opacity times sqrt(det0 / det)
    bool sort_by_distance = false;  ///< order by |mean - camera's centre|, not by depth
    bool cut_3_sigma = false;       ///< alpha is 0 where sigma > 9/2
    RasterGradient gradient = RasterGradient::kTrue;
    Real near_plane = static_cast<Real>(raster::kNearGsplat);
    Real far_plane = static_cast<Real>(raster::kFarGsplat);

    [[nodiscard]] bool is_3dgs() const { return convention == Convention::k3dgs; }
    [[nodiscard]] bool is_gsplat() const { return convention == Convention::kGsplat; }
    [[nodiscard]] bool is_ray() const { return convention == Convention::kRayMaximum; }
    [[nodiscard]] bool is_original() const { return gradient == RasterGradient::kOriginal; }
};

/// The default planes of each convention; only gsplat has a far plane.
template <class Real>
RasterOptions<Real> raster_options(Convention convention, bool antialiased = false,
                                   RasterGradient gradient = RasterGradient::kTrue) {
    RasterOptions<Real> options;
    options.convention = convention;
    options.antialiased = antialiased;
    options.gradient = gradient;
    if (!options.is_gsplat()) options.near_plane = static_cast<Real>(raster::kNear3dgs);
    return options;
}

template <class Real>
struct RasterScene {
    std::vector<Real> means;      ///< [n,3]
    std::vector<Real> scales;     ///< [n,3] standard deviations
    std::vector<Real> rotations;  ///< [n,4] w, x, y, z
    std::vector<Real> opacities;  ///< [n] 0 to 1
    std::vector<Real> sh;         ///< [n,sh_coefficients,3], or empty if there are colors
    std::vector<Real> colors;     ///< [n,3] used as they are, or empty if there is sh
    std::size_t sh_coefficients = 0;
    std::array<Real, 3> background{};
    RasterCamera<Real> camera;
    RasterOptions<Real> options;

    [[nodiscard]] std::size_t count() const { return opacities.size(); }
    [[nodiscard]] std::size_t pixels() const { return camera.width * camera.height; }
    [[nodiscard]] std::size_t tiles_x() const {
        return (camera.width + raster::kTileSize - 1) / raster::kTileSize;
    }
    [[nodiscard]] std::size_t tiles_y() const {
        return (camera.height + raster::kTileSize - 1) / raster::kTileSize;
    }
};

template <class Real>
using Vec3 = std::array<Real, 3>;
template <class Real>
using Mat3 = std::array<std::array<Real, 3>, 3>;

template <class Real>
Real dot(const Vec3<Real>& a, const Vec3<Real>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
Vec3<Real> cross(const Vec3<Real>& a, const Vec3<Real>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class Real>
Vec3<Real> product(const Mat3<Real>& a, const Vec3<Real>& x) {
    return {dot(a[0], x), dot(a[1], x), dot(a[2], x)};
}

template <class Real>
Mat3<Real> transposed(const Mat3<Real>& a) {
    Mat3<Real> result{};
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 3; ++c) result[r][c] = a[c][r];
    return result;
}

template <class Real>
Mat3<Real> product(const Mat3<Real>& a, const Mat3<Real>& b) {
    const Mat3<Real> columns = transposed(b);
    Mat3<Real> result{};
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 3; ++c) result[r][c] = dot(a[r], columns[c]);
    return result;
}

/// Three numbers of a [n,3] tensor.
template <class Real>
Vec3<Real> row3(const std::vector<Real>& tensor, std::size_t i) {
    return {tensor[3 * i], tensor[3 * i + 1], tensor[3 * i + 2]};
}

template <class Real>
void add_row3(std::vector<Real>& tensor, std::size_t i, const Vec3<Real>& term) {
    for (std::size_t k = 0; k < 3; ++k) tensor[3 * i + k] += term[k];
}

/// Rotation part of world_to_camera, its translation, and the camera's centre in the world.
template <class Real>
struct CameraFrame {
    Mat3<Real> rotation{};
    Vec3<Real> translation{};
    Mat3<Real> inverse{};  ///< inverse of `rotation`, which need not be one
    Vec3<Real> centre{};

    explicit CameraFrame(const RasterCamera<Real>& camera) {
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = 0; c < 3; ++c) rotation[r][c] = camera.world_to_camera[4 * r + c];
            translation[r] = camera.world_to_camera[4 * r + 3];
        }
        const Mat3<Real>& m = rotation;
        const Mat3<Real> cofactors = {cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])};
        inverse = transposed(cofactors);
        const Real determinant = dot(m[0], cofactors[0]);
        for (Vec3<Real>& row : inverse)
            for (Real& element : row) element /= determinant;
        const Vec3<Real> moved = product(inverse, translation);
        for (std::size_t k = 0; k < 3; ++k) centre[k] = -moved[k];
    }
};

/// Matrix of a quaternion w, x, y, z; a rotation if its length is 1.
template <class Real>
Mat3<Real> quaternion_matrix(const std::array<Real, 4>& q) {
    const auto [w, x, y, z] = q;
    const Real one(1);
    const Real two(2);
    return {{{one - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)},
             {two * (x * y + w * z), one - two * (x * x + z * z), two * (y * z - w * x)},
             {two * (x * z - w * y), two * (y * z + w * x), one - two * (x * x + y * y)}}};
}

/// Gradient with respect to q of a loss whose gradient with respect to quaternion_matrix(q) is g.
template <class Real>
std::array<Real, 4> quaternion_matrix_backward(const std::array<Real, 4>& q, const Mat3<Real>& g) {
    const auto [w, x, y, z] = q;
    const Real two(2);
    return {two * (x * (g[2][1] - g[1][2]) + y * (g[0][2] - g[2][0]) + z * (g[1][0] - g[0][1])),
            two * (w * (g[2][1] - g[1][2]) + y * (g[0][1] + g[1][0]) + z * (g[0][2] + g[2][0]) -
                   two * x * (g[1][1] + g[2][2])),
            two * (w * (g[0][2] - g[2][0]) + x * (g[0][1] + g[1][0]) + z * (g[1][2] + g[2][1]) -
                   two * y * (g[0][0] + g[2][2])),
            two * (w * (g[1][0] - g[0][1]) + x * (g[0][2] + g[2][0]) + y * (g[1][2] + g[2][1]) -
                   two * z * (g[0][0] + g[1][1]))};
}

}  // namespace splat::ref
