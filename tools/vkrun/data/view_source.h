#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/config/image_channels.h"

namespace vkrun {

/// Views of one object, in the frame of the first.
struct Views {
    std::vector<float> inputs;  ///< [n, channels, R, R]
    std::vector<float> images;  ///< [n, 3, R, R]
    std::vector<float> view_to_world, quaternions, focals;
    std::vector<splat_camera> cameras;
};

/// A split of a data set, opened as a configuration says, for reading views of its objects.
class ViewSource {
  public:
    /// config  a merged one; `root`, unless empty, replaces data.root. Throws a Failure.
    ViewSource(const Json& config, const std::string& root, const std::string& split);

    [[nodiscard]] std::uint32_t objects() const {
        return static_cast<std::uint32_t>(names_.size());
    }
    [[nodiscard]] const std::string& name(std::uint32_t object) const { return names_[object]; }
    [[nodiscard]] std::uint32_t views_of(std::uint32_t object) const { return views_[object]; }
    [[nodiscard]] std::uint32_t resolution() const { return resolution_; }
    [[nodiscard]] const Json& report() const { return report_; }

    /// The views with these numbers, in this order; inputs for the first `inputs` of them. May be called from
    /// any thread. Throws a Failure.
    [[nodiscard]] Views read(std::uint32_t object, const std::vector<std::uint32_t>& views,
                             std::uint32_t inputs, const ImageChannels& channels) const;

  private:
    Dataset dataset_;
    Json report_;
    std::vector<std::string> names_;
    std::vector<std::uint32_t> views_;
    std::uint32_t resolution_ = 0;
};

/// The inverse of a rigid pose, given as a row-vector matrix, in the form of world_to_camera.
std::array<double, 16> inverse_pose(const float* view_to_world);

}  // namespace vkrun
