#pragma once

#include <string>
#include <vector>

#include "ref/raster_scene_ref.h"

namespace vkrun::stress {

using RasterScene = splat::ref::RasterScene<double>;  ///< numbers that float32 holds

/// Spherical harmonics up to degree 1.
constexpr std::size_t kShCoefficients = 4;

struct RasterStress {
    std::string name;   ///< "needle/1e4_gsplat"
    std::string input;  ///< in words
    RasterScene scene;
};

std::vector<RasterStress> raster_families(bool quick);

/// 3,000 small Gaussians, 160 x 120 pixels, to be timed.
RasterScene bench_scene();

}  // namespace vkrun::stress
