#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/raster/raster_bench.h"

namespace vkrun::bench {

/// Float64 images and gradients at a sample of pixels of the first view (tests/ref).
class RasterReference {
  public:
    RasterReference(const RasterCase& from, int samples);

    /// dL/dRGB, [H,W,3]: random numbers at the samples, zero elsewhere.
    [[nodiscard]] const std::vector<float>& grad_rgb() const { return grad_rgb_; }

    [[nodiscard]] RasterError compare(
        const std::vector<float>& rgb,
        const std::map<std::string, std::vector<float>>& gradients) const;

  private:
    std::vector<std::size_t> pixels_;
    std::vector<double> rgb_;  ///< [samples,3]
    std::vector<float> grad_rgb_;
    std::map<std::string, std::vector<double>> gradients_;
};

/// Pairs of a tile and a Gaussian that any list must hold, over all views: those with a pixel of alpha
/// >= 1/255 in float64. Pairs hidden by opaque Gaussians count, too.
std::uint64_t fewest_pairs(const RasterCase& from);

}  // namespace vkrun::bench
