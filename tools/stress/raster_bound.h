#pragma once

#include <map>
#include <string>
#include <vector>

#include "ref/rasterize_ref.h"
#include "stress/raster_scenes.h"
#include "stress/stress.h"

namespace vkrun::stress {

using RasterLoss = splat::ref::RasterLoss<double>;

template <class Real>
using RasterResults = std::map<std::string, std::vector<Real>>;

/// Images, numbers of the projection and gradients in float64, and how far float32 may lie from each tensor.
///
/// The bound is the function's condition, not an algorithm's: `samples` further runs in float64 move every input,
/// the camera, every number of the projection that blending reads, and every weight of the loss at random, each by
/// the roundings that Vulkan's table (tests/ref/rounded.h) allows the operations that it comes from. Four times the
/// largest change of a tensor is allowed, and the rounding of a sum of as many terms as a pixel blends Gaussians.
std::map<std::string, Expected> raster_expected(const RasterScene& scene, const RasterLoss& loss,
                                                int samples);
extern const char* const kRasterReason;

/// The published formulas in float32, with the determinant as a difference.
RasterResults<float> published_in_float32(const RasterScene& scene, const RasterLoss& loss);

}  // namespace vkrun::stress
