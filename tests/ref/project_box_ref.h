#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ref/raster_scene_ref.h"

/// The projection of a Gaussian, and its bounding box, which decides in which tiles it is listed.
namespace splat::ref {

/// What the convention ray_maximum keeps of a Gaussian, see project_ray_ref.h.
template <class Real>
struct RayGaussian {
    bool used = false;
    Mat3<Real> whitening{};   ///< S^-1 Rq^-1 R^-1
    Mat3<Real> covariance{};  ///< in camera coordinates
    RasterCamera<Real> camera;
    Real near_plane = 0;
};

template <class Real>
struct ProjectedGaussian {
    bool valid = false;
    std::array<Real, 2> mean2d{};
    std::array<Real, 3> conic{};
    Real depth = 0;
    std::array<std::int64_t, 2> radius{};
    std::array<std::size_t, 4> tiles{};  ///< first x, first y, end x, end y of its bounding box
    Vec3<Real> color{};
    Real opacity = 0;  ///< with compensation
    Real reach = 0;    ///< beyond this sigma alpha is certainly below kAlphaMin, or cut
    Vec3<Real> normal{};
    RayGaussian<Real> ray;

    // Intermediate values for the backward pass.
    Vec3<Real> camera_mean{};
    std::array<Real, 4> quaternion{};  ///< quaternion as used: of length 1 in gsplat
    Real quaternion_norm = 0;
    Mat3<Real> rotation{};          ///< Rq
    Mat3<Real> camera_axes{};       ///< R Rq S
    std::array<Real, 2> slope{};    ///< clamped x/z, y/z
    std::array<bool, 2> clamped{};  ///< true if the clamp acted
    std::array<Vec3<Real>, 2> rows{};
    std::array<Real, 3> cov{};  ///< a, b, c with dilation
    Real det0 = 0;
    Real det = 0;
    Real compensation = 0;   ///< factor of the opacity
    Vec3<Real> direction{};  ///< from the camera's centre, of length 1
    Real distance = 0;
    std::array<bool, 3> color_clamped{};
};

template <class Real>
struct ProjectForward {
    std::vector<ProjectedGaussian<Real>> gaussians;
    std::vector<std::uint32_t> order;  ///< valid ones by float32 order_key(), then by index
};

/// Half sizes of the box, in pixels.
template <class Real>
std::array<Real, 2> project_extent(const RasterScene<Real>& scene,
                                   const ProjectedGaussian<Real>& g) {
    const auto [a, b, c] = g.cov;
    if (scene.options.is_3dgs()) {
        const Real middle = (a + c) / Real(2);
        const Real difference = (a - c) / Real(2);
        const Real root = std::sqrt(
            std::max(static_cast<Real>(raster::kLambdaFloor), difference * difference + b * b));
        const Real extent =
            std::ceil(static_cast<Real>(raster::kSigma3dgs) * std::sqrt(middle + root));
        return {extent, extent};
    }
    const Real reach =
        std::sqrt(Real(2) * std::log(g.opacity / static_cast<Real>(raster::kAlphaMin)));
    const Real sigmas = std::min(static_cast<Real>(raster::kMaxSigma), reach);
    return {std::ceil(sigmas * std::sqrt(a)), std::ceil(sigmas * std::sqrt(c))};
}

/// Radii and the tiles of the box; false if it misses the image.
template <class Real>
bool project_box(const RasterScene<Real>& scene, ProjectedGaussian<Real>& g) {
    const std::array<Real, 2> extent = project_extent(scene, g);
    const std::array<std::size_t, 2> tile_counts{scene.tiles_x(), scene.tiles_y()};
    const std::array<std::size_t, 2> sizes{scene.camera.width, scene.camera.height};
    const Real tile(raster::kTileSize);
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const Real position = g.mean2d[axis];
        const auto size = static_cast<Real>(sizes[axis]);
        Real first = std::floor((position - extent[axis]) / tile);
        Real end = std::ceil((position + extent[axis]) / tile);
        if (scene.options.is_3dgs()) {
            // The original's pixel centres are whole numbers, half a pixel less than ours.
            const Real whole = position - Real(0.5);
            first = std::trunc((whole - extent[axis]) / tile);
            end = std::trunc((whole + extent[axis] + tile - Real(1)) / tile);
        } else if (!(position + extent[axis] > Real(0)) || !(position - extent[axis] < size)) {
            return false;
        }
        const auto most = static_cast<Real>(tile_counts[axis]);
        g.tiles[axis] = static_cast<std::size_t>(std::clamp(first, Real(0), most));
        g.tiles[axis + 2] = static_cast<std::size_t>(std::clamp(end, Real(0), most));
        const Real largest(1U << 30U);
        g.radius[axis] = static_cast<std::int64_t>(std::min(extent[axis], largest));
    }
    return scene.options.is_3dgs() ? g.tiles[0] < g.tiles[2] && g.tiles[1] < g.tiles[3]
                                   : g.radius[0] > 0 || g.radius[1] > 0;
}

}  // namespace splat::ref
