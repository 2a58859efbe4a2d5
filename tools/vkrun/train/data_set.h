#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vkrun/device_text.h"
#include "vkrun/objects.h"

namespace vkrun {

/// What an input image has behind RGB.
struct ImageChannels {
    bool depth = false, normal = false, mask = false;
    bool origin_distance = false;  ///< a last plane

    /// Of a merged configuration.
    static ImageChannels of(const Json& config);
    [[nodiscard]] std::uint32_t count() const;
    [[nodiscard]] std::uint32_t flags() const;  ///< SPLAT_DATA_*
};

/// Views of one object, and of its world: the frame of the first.
struct Views {
    std::vector<float> inputs;  ///< [n, channels, R, R]
    std::vector<float> images;  ///< [n, 3, R, R]
    std::vector<float> view_to_world, quaternions, focals;
    std::vector<splat_camera> cameras;
};

/// A data set of the library with what its report says.
class DataSet {
  public:
    /// Of a merged configuration; `root` replaces data.root unless empty. Throws a Failure.
    DataSet(const Json& config, const std::string& root, const std::string& split);

    [[nodiscard]] std::uint32_t objects() const {
        return static_cast<std::uint32_t>(names_.size());
    }
    [[nodiscard]] const std::string& name(std::uint32_t object) const { return names_[object]; }
    [[nodiscard]] std::uint32_t views_of(std::uint32_t object) const { return views_[object]; }
    [[nodiscard]] std::uint32_t resolution() const { return resolution_; }
    [[nodiscard]] const Json& report() const { return report_; }

    /// The views with these numbers, in this order; inputs for the first `inputs` of them. From any
    /// thread. Throws a Failure.
    [[nodiscard]] Views read(std::uint32_t object, const std::vector<std::uint32_t>& views,
                             std::uint32_t inputs, const ImageChannels& channels) const;

  private:
    Owner<splat_dataset, splat_dataset_destroy> handle_;
    Json report_;
    std::vector<std::string> names_;
    std::vector<std::uint32_t> views_;
    std::uint32_t resolution_ = 0;
};

/// The inverse of a rigid pose that is given as a row-vector matrix, as world_to_camera.
std::array<double, 16> inverse_pose(const float* view_to_world);

}  // namespace vkrun
