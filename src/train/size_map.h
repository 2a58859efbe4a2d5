#pragma once

#include "gaussians/gaussian_set.h"
#include "raster/rasterizer.h"

namespace splat::train {

/// Weights of pixels by the size of the Gaussians that they show, so that a loss asks more where large Gaussians
/// blur an image: with s_i the longest axis of Gaussian i and b_i its share of the pixel's colour,
///
///   weight = sum_i b_i s_i / the mean of that over all pixels of the views,
///
/// and 1 everywhere if nothing is drawn. A constant: no gradient goes through it. The host takes the longest axes and
/// the mean, so that a call reads N Gaussians and the image back and writes both; they may be part of a longer set.
///
/// Errors       those of raster::Rasterizer and Context::run
/// Determinism  bit-exact for any thread count
class SizeMap {
  public:
    /// For scenes and views of `desc`. Errors: those of Rasterizer::create.
    static Result<SizeMap> create(vk::Context& context, raster::RasterDesc desc);

    /// weights  [V,1,H,W] as quads, overwritten
    Status draw(const gaussians::SetViews& scene, std::span<const scene::Camera> cameras,
                const vk::BufferView& weights);

  private:
    explicit SizeMap(vk::Context& context) : context_(&context) {}

    vk::Context* context_;
    std::unique_ptr<raster::Rasterizer> rasterizer_;
    vk::Buffer gaussians_,
        sizes_;  ///< [N,3] quads of the scene; [N] quads: a Gaussian's size as its red
};

}  // namespace splat::train
