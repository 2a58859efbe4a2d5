#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ref/blend_ref.h"

/// How many tiles and pixels a Gaussian reaches: bounds for the lists of a tile test.
namespace splat::ref {

struct TileBin {
    std::vector<std::int64_t> tiles_rect;      ///< [n] tiles of the bounding box
    std::vector<std::int64_t> tiles_exact;     ///< [n] tiles with a pixel of alpha >= kAlphaMin
    std::vector<std::int64_t> pixels_visible;  ///< [n] pixels of alpha >= kAlphaMin
};

/// The exact counts leave out occlusion and, in 3dgs, the cut at the box.
template <class Real>
TileBin tile_bin(const RasterScene<Real>& scene, const ProjectForward<Real>& projected) {
    const std::size_t n = scene.count();
    TileBin out{std::vector<std::int64_t>(n), std::vector<std::int64_t>(n),
                std::vector<std::int64_t>(n)};
    for (const std::uint32_t i : projected.order) {
        const ProjectedGaussian<Real>& g = projected.gaussians[i];
        const std::size_t tiles = (g.tiles[2] - g.tiles[0]) * (g.tiles[3] - g.tiles[1]);
        out.tiles_rect[i] = static_cast<std::int64_t>(tiles);
        std::vector<bool> seen(scene.tiles_x() * scene.tiles_y());
        for (std::size_t row = 0; row < scene.camera.height; ++row)
            for (std::size_t column = 0; column < scene.camera.width; ++column) {
                const Blended<Real> hit = density_at(g, column, row);
                if (hit.alpha < static_cast<Real>(raster::kAlphaMin)) continue;
                ++out.pixels_visible[i];
                seen[row / raster::kTileSize * scene.tiles_x() + column / raster::kTileSize] = true;
            }
        for (const bool tile : seen) out.tiles_exact[i] += tile ? 1 : 0;
    }
    return out;
}

}  // namespace splat::ref
