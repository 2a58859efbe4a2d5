#pragma once

#include <memory>
#include <span>
#include <vector>

#include "config/config_keys.h"
#include "io/weights_file.h"
#include "model/model.h"
#include "model/weights.h"
#include "predict/view_source.h"
#include "raster/pack.h"
#include "raster/rasterizer.h"
#include "scene/gaussians.h"
#include "vk/context.h"

namespace splat::predict {

/// A depth map and how opaque each pixel is.
struct Depth {
    std::vector<float> depth, alpha;  ///< [R,R]
};

/// A network that predicts scenes of one object, and a rasterizer for images of them. It has no adapters:
/// those of weights are folded in, which gives the same predictions in less time.
///
/// Not thread-safe. Each method that is not const is one operation of the device: the caller locks the
/// context's mutex around it, also around the destructor.
class Predictor {
  public:
    /// Images per pass of the rasterizer: few passes, and little memory.
    static constexpr std::uint32_t kDrawnAtOnce = 16;

    /// Parameters are zero until load(). Errors: those of model::Model::create.
    static Result<std::unique_ptr<Predictor>> create(vk::Context& context,
                                                     const config::Settings& settings);

    /// Load a state dict. Its adapters are folded in if the configuration has adapters; its ray grid is
    /// taken over where it differs (report.rays_taken). Errors: those of model::merge_adapters and
    /// model::load_state; the network then stays as it was.
    Status load(const io::WeightsFile& file, model::LoadReport& report);

    /// The Gaussians of an object from its first views() views. Errors: kShape for inputs of another size;
    /// those of model::Model::set_input and of a forward pass.
    Result<scene::Gaussians> predict(const Views& views);

    /// True if every number that the network put out in the latest predict() is finite. If not, weights or
    /// inputs are beyond what float32 holds, and the Gaussians mean nothing. Errors: those of Context::read.
    [[nodiscard]] Result<bool> finite_output() const;

    /// Copy Gaussians to the device for draw().
    Status show(const scene::Gaussians& gaussians);

    /// Images [n,3,R,R] of what show() copied, of at most kDrawnAtOnce cameras.
    Result<std::vector<float>> draw(std::span<const scene::Camera> cameras);

    /// show(), then draw() as often as needed. For few cameras: the device is not free for others in between.
    Result<std::vector<float>> draw(const scene::Gaussians& gaussians,
                                    std::span<const scene::Camera> cameras);

    /// Expected depth along z, and how opaque each pixel is.
    Result<Depth> draw_depth(const scene::Gaussians& gaussians, const scene::Camera& camera);

    /// The camera of a first view: at the origin, looking along z, with data.fov. Errors: kInvalidArgument
    /// for a configuration whose views have focal lengths of their own.
    [[nodiscard]] Result<scene::Camera> camera() const;

    /// CRC-32 of the configuration and of all parameters, as hexadecimal text. Errors: those of Context::read.
    Result<std::string> checksum();

    [[nodiscard]] const std::array<float, 3>& background() const { return background_; }
    [[nodiscard]] std::uint32_t views() const { return config().views; }
    [[nodiscard]] std::uint32_t resolution() const { return config().resolution; }
    [[nodiscard]] const config::ModelConfig& config() const { return model_->config(); }
    [[nodiscard]] model::Model& model() { return *model_; }

  private:
    Predictor(vk::Context& context, const config::Settings& settings);

    vk::Context& context_;
    std::array<float, 3> background_;
    bool adapted_;  ///< the configuration's weights have adapters
    double lora_alpha_;
    std::uint32_t config_checksum_;
    std::unique_ptr<model::Model> model_;
    raster::PackedBuffers scene_;  ///< scene that the rasterizer's command lists name
    std::unique_ptr<raster::Rasterizer> rasterizer_;  ///< destroyed before `scene_`
    std::uint64_t version_ = 0;                       ///< version of the contents of `scene_`
    std::uint32_t shown_degree_ = 0;
};

/// Object `index` of the latest forward pass of a model of `objects` objects, in the parameters of scenes.
/// Errors: those of Context::read.
Result<scene::Gaussians> gaussians_of(vk::Context& context, const model::Model& model,
                                      std::uint32_t objects, std::uint32_t index);

}  // namespace splat::predict
