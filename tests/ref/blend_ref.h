#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ref/project_ray_ref.h"
#include "ref/project_ref.h"
#include "ref/raster_scene_ref.h"

/// Front-to-back blending of projected Gaussians, every Gaussian against every pixel.
///
///   alpha_i = min(kAlphaMax, opacity_i exp(-sigma_i))      T_1 = 1, T_{i+1} = T_i (1 - alpha_i)
///   w_i = alpha_i T_i      rgb = sum w_i color_i + T_end background      alpha = 1 - T_end
///   depth = sum w_i z_i      depth_expected = depth / max(alpha, kExpectedAlphaMin)
///   median = z_i of the last i with T_i > kMedianTransmittance, 0 if there is none
///
/// Skipped: alpha < kAlphaMin; with cut_3_sigma also sigma > 9/2; in 3dgs also pixels whose tile the
/// box does not meet. ray_maximum: sigma and z_i are those of the maximum along the pixel's ray (project_ray_ref.h),
/// skipped unless z_i > near. A pixel stops before the first Gaussian that would leave
/// T < kTransmittanceMin (gsplat: <=).
namespace splat::ref {

/// One Gaussian that a pixel blends.
template <class Real>
struct Blended {
    std::uint32_t index = 0;
    Real dx = 0;  ///< mean2d - pixel centre
    Real dy = 0;
    Real density = 0;  ///< opacity exp(-sigma), not clamped
    Real alpha = 0;
    Real depth = 0;
    Real transmittance = 0;  ///< in front of it
};

/// All that a pixel blends, in order, and the transmittance behind it.
template <class Real>
struct BlendedPixel {
    std::vector<Blended<Real>> hits;
    Real transmittance = 1;
};

template <class Real>
struct BlendForward {
    std::vector<Real> rgb;                ///< [H,W,3]
    std::vector<Real> alpha;              ///< [H,W]
    std::vector<Real> depth;              ///< [H,W] accumulated
    std::vector<Real> depth_expected;     ///< [H,W]
    std::vector<Real> median;             ///< [H,W]
    std::vector<Real> median_early;       ///< [H,W] median if T_i were less by 1e-4 of it
    std::vector<Real> normal;             ///< [H,W,3] accumulated, no background
    std::vector<std::int64_t> n_contrib;  ///< [H,W] Gaussians blended
};

/// True if the convention lets the pixel see the Gaussian at all.
template <class Real>
bool reaches(const RasterScene<Real>& scene, const ProjectedGaussian<Real>& g, std::size_t column,
             std::size_t row) {
    if (!scene.options.is_3dgs()) return true;
    const std::size_t x = column / raster::kTileSize;
    const std::size_t y = row / raster::kTileSize;
    return g.tiles[0] <= x && x < g.tiles[2] && g.tiles[1] <= y && y < g.tiles[3];
}

/// The Gaussian at a pixel, as if nothing were in front of it.
template <class Real>
Blended<Real> density_at(const ProjectedGaussian<Real>& g, std::size_t column, std::size_t row) {
    Blended<Real> hit;
    hit.dx = g.mean2d[0] - (static_cast<Real>(column) + Real(0.5));
    hit.dy = g.mean2d[1] - (static_cast<Real>(row) + Real(0.5));
    hit.depth = g.depth;
    const auto [A, B, C] = g.conic;
    Real sigma = (A * hit.dx * hit.dx + C * hit.dy * hit.dy) / Real(2) + B * hit.dx * hit.dy;
    if (g.ray.used) {
        const RayMaximum<Real> seen = ray_maximum(g, column, row);
        sigma = seen.squared / Real(2);
        hit.depth = seen.depth;
        if (!(seen.depth > g.ray.near_plane)) return hit;
    }
    if (sigma < Real(0) || sigma > g.reach) return hit;
    hit.density = g.opacity * std::exp(-sigma);
    hit.alpha = std::min(static_cast<Real>(raster::kAlphaMax), hit.density);
    return hit;
}

template <class Real>
BlendedPixel<Real> blend_pixel(const RasterScene<Real>& scene,
                               const ProjectForward<Real>& projected, std::size_t column,
                               std::size_t row) {
    BlendedPixel<Real> pixel;
    const auto least = static_cast<Real>(raster::kTransmittanceMin);
    for (const std::uint32_t index : projected.order) {
        const ProjectedGaussian<Real>& g = projected.gaussians[index];
        if (!reaches(scene, g, column, row)) continue;
        Blended<Real> hit = density_at(g, column, row);
        if (hit.alpha < static_cast<Real>(raster::kAlphaMin)) continue;
        const Real behind = pixel.transmittance * (Real(1) - hit.alpha);
        if (scene.options.is_gsplat() ? behind <= least : behind < least) break;
        hit.index = index;
        hit.transmittance = pixel.transmittance;
        pixel.hits.push_back(hit);
        pixel.transmittance = behind;
    }
    return pixel;
}

template <class Real>
BlendForward<Real> blend_forward(const RasterScene<Real>& scene,
                                 const ProjectForward<Real>& projected) {
    BlendForward<Real> out;
    const auto floor = static_cast<Real>(raster::kExpectedAlphaMin);
    for (std::size_t row = 0; row < scene.camera.height; ++row)
        for (std::size_t column = 0; column < scene.camera.width; ++column) {
            const BlendedPixel<Real> pixel = blend_pixel(scene, projected, column, row);
            Vec3<Real> rgb{};
            Vec3<Real> normal{};
            Real depth(0);
            Real median(0);
            Real median_early(0);
            for (const Blended<Real>& hit : pixel.hits) {
                const ProjectedGaussian<Real>& g = projected.gaussians[hit.index];
                const Real weight = hit.alpha * hit.transmittance;
                depth += weight * hit.depth;
                const auto half = static_cast<Real>(raster::kMedianTransmittance);
                if (hit.transmittance > half) median = hit.depth;
                if (hit.transmittance > half * Real(1.0001)) median_early = hit.depth;
                for (std::size_t k = 0; k < 3; ++k) {
                    rgb[k] += weight * g.color[k];
                    normal[k] += weight * g.normal[k];
                }
            }
            const Real alpha = Real(1) - pixel.transmittance;
            for (std::size_t k = 0; k < 3; ++k) {
                out.rgb.push_back(rgb[k] + pixel.transmittance * scene.background[k]);
                out.normal.push_back(normal[k]);
            }
            out.alpha.push_back(alpha);
            out.depth.push_back(depth);
            out.median.push_back(median);
            out.median_early.push_back(median_early);
            out.depth_expected.push_back(depth / std::max(alpha, floor));
            out.n_contrib.push_back(static_cast<std::int64_t>(pixel.hits.size()));
        }
    return out;
}

/// What each Gaussian adds to an image: the sum of its weights w_i, and the number of pixels that
/// blend it; and for each pixel the Gaussian of the largest weight (the first of equals), or -1.
template <class Real>
struct BlendContributions {
    std::vector<Real> weights;          ///< [n]
    std::vector<std::int64_t> pixels;   ///< [n]
    std::vector<std::int64_t> ids;      ///< [H,W]
    std::vector<Real> largest, second;  ///< [H,W] the two largest weights
};

template <class Real>
BlendContributions<Real> blend_contributions(const RasterScene<Real>& scene,
                                             const ProjectForward<Real>& projected) {
    BlendContributions<Real> out;
    out.weights.resize(scene.count());
    out.pixels.resize(scene.count());
    for (std::size_t p = 0; p < scene.pixels(); ++p) {
        const std::size_t width = scene.camera.width;
        Real largest(0);
        Real second(0);
        std::int64_t id = -1;
        for (const Blended<Real>& hit : blend_pixel(scene, projected, p % width, p / width).hits) {
            const Real weight = hit.alpha * hit.transmittance;
            out.weights[hit.index] += weight;
            ++out.pixels[hit.index];
            second = std::max(second, std::min(weight, largest));
            if (weight > largest) id = hit.index;
            largest = std::max(largest, weight);
        }
        out.ids.push_back(id);
        out.largest.push_back(largest);
        out.second.push_back(second);
    }
    return out;
}

}  // namespace splat::ref
