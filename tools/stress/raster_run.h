#pragma once

#include <map>
#include <string>

#include "stress/raster_bound.h"
#include "vkrun/cli/handles.h"

namespace vkrun::stress {

/// A scene on a device, and its rasterizer.
class RasterOnDevice {
  public:
    /// loss  without numbers: no backward pass
    RasterOnDevice(splat_device device, const RasterScene& scene, const RasterLoss& loss,
                   std::uint32_t disabled_skips = 0);

    void forward();
    void backward();
    /// After a pass of each kind, by the names of raster_expected().
    [[nodiscard]] RasterResults<float> results();
    [[nodiscard]] std::vector<float> output(splat_output output, std::size_t count) const;
    [[nodiscard]] splat_tensor gradient(const std::string& name) const {
        return gradients_.at(name).get();
    }

  private:
    std::size_t count_, pixels_;
    bool rays_ = false;  ///< a convention without gradients and conics
    splat_camera camera_{};
    float background_[3];
    std::map<std::string, Tensor> inputs_, gradients_, weights_;
    Rasterizer rasterizer_;
};

}  // namespace vkrun::stress
