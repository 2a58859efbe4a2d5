#pragma once

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/config/image_channels.h"
#include "vkrun/data/view_source.h"

namespace vkrun {

/// A depth map and how opaque each pixel is.
struct Depth {
    std::vector<float> depth, alpha;  ///< [R,R]
};

/// A network that predicts scenes of one object, and a rasterizer for images of them. It has no adapters:
/// those of weights are folded in, which gives the same predictions in less time.
class Network {
  public:
    Network(splat_device device, const Json& config);

    /// Load a file of weights and take over its field of view, with a warning if that differs from data.fov.
    void load(const std::string& path);
    void load(splat_weights weights);  ///< the same without the warning

    /// The Gaussians of an object from its first data.input_images views.
    Scene predict(const Views& views);

    /// Images [n,3,R,R].
    std::vector<float> draw(const Scene& scene, const std::vector<splat_camera>& cameras);

    /// Expected depth along z, and how opaque each pixel is.
    Depth draw_depth(const Scene& scene, const splat_camera& camera);

    /// The camera of a first view: at the origin, looking along z, with data.fov.
    [[nodiscard]] splat_camera camera() const;

    [[nodiscard]] const float* background() const { return background_; }
    [[nodiscard]] std::uint32_t views() const { return views_; }
    [[nodiscard]] std::uint32_t resolution() const { return resolution_; }
    [[nodiscard]] const ImageChannels& channels() const { return channels_; }

  private:
    splat_device device_;
    Model model_;
    Rasterizer rasterizer_;
    std::uint64_t gaussians_ = 0;  ///< that the rasterizer was made for
    std::uint32_t views_ = 0, resolution_ = 0;
    ImageChannels channels_;
    double fov_degrees_ = 0;
    bool adapted_ = false;  ///< the configuration's weights have adapters
    double lora_alpha_ = 0;
    float background_[3] = {1, 1, 1};
};

}  // namespace vkrun
