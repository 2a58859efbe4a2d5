#pragma once

#include <span>
#include <vector>

#include "config/model_config.h"
#include "raster/rasterizer.h"

namespace splat::predict {

/// Images of Gaussians from further views, as networks with the inputs of F3D-Gaus take them.
struct DrawnViews {
    std::size_t side = 0;       ///< R
    std::vector<float> quads;   ///< [n,R,R,4] RGB and alpha
    std::vector<float> depths;  ///< [n,R,R] median depth, scene units

    /// Add the planes [5,R,R] of a view: RGB and alpha from 0 to 1, depth.
    void append_planes(std::size_t view, std::vector<float>& to) const;
};

/// True for a network of one picture of colours and mask, with depths for its head and a field of view: what drawn
/// views have.
bool takes_drawn_views(const config::ModelConfig& network);

/// A rasterizer of such images: `views` squares of `side` pixels.
raster::RasterDesc drawn_views_desc(const gaussians::SetDesc& set, std::uint32_t views,
                                    std::uint32_t side, raster::Convention convention);

/// Draw and read them. Depth is `beyond` where nothing is drawn: the published program leaves 0 there, which puts
/// Gaussians into the camera, where they fill other images. Errors: those of raster::pack_views, of the rasterizer and
/// of Context::read.
Result<DrawnViews> draw_views(vk::Context& context, raster::Rasterizer& rasterizer,
                              const gaussians::SetViews& scene,
                              std::span<const scene::Camera> cameras,
                              const std::array<float, 3>& background, float beyond);

}  // namespace splat::predict
