#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "config/config_keys.h"
#include "gaussians/gaussian_set.h"
#include "io/weights_file.h"
#include "model/model.h"
#include "model/weights.h"
#include "predict/view_source.h"
#include "raster/rasterizer.h"
#include "vk/context.h"

namespace splat::predict {

/// Most views of an aggregation: a joined scene has one more times the network's Gaussians.
inline constexpr std::uint32_t kMostAggregated = 64;

/// From how many further views predictions are made, too, and how these are drawn.
struct Aggregation {
    std::uint32_t views = 0;  ///< 0: none
    raster::Convention convention = raster::Convention::k3dgs;
};

/// Errors: kInvalidArgument for another number of views than 0 or 2 to kMostAggregated, and for a network that does not
/// take what drawn views have.
Status check_aggregation(const config::ModelConfig& network, std::uint32_t views);

/// The cameras of an aggregation, in the frame of the first: around the point in the middle of znear and zfar, yaw
/// -0.25 sin t, pitch 0.15 cos t, t from 0 to 2 pi (W-Ted/F3D-Gaus 8e52aec). `views`: 2 or more.
Result<std::vector<scene::Camera>> orbit_of_aggregation(const config::ModelConfig& network,
                                                        std::uint32_t views);

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

    /// Checks names and shapes for load(), before create() takes memory. Errors: those of model::check_state.
    static Status check(vk::Context& context, const config::Settings& settings,
                        const io::WeightsFile& file);

    /// Load a state dict. Its adapters are folded in if the configuration has adapters; its ray grid is
    /// taken over where it differs (report.rays_taken). Errors: those of model::merge_adapters and
    /// model::load_state; the network then stays as it was.
    Status load(const io::WeightsFile& file, model::LoadReport& report);

    /// Predict the Gaussians of an object from its first views() views. They stay on the device. Errors: kShape
    /// for inputs of another size; those of model::Model::set_input and of a forward pass.
    Status predict(const Views& views);

    /// Predict, draw what is predicted from further views, predict each of these, and join all Gaussians, those
    /// of the picture first. ledger() is that of the last prediction; if its output is not finite, the result is empty.
    /// Errors: those of check_aggregation, predict, scene and of the rasterizer.
    Result<gaussians::Downloaded> aggregate(const Views& views, const Aggregation& options);

    /// The predicted Gaussians that an image can show, of model.head.opacity_threshold or more. Errors: those of
    /// Context::read.
    [[nodiscard]] Result<gaussians::Downloaded> scene() const {
        return gaussians::download(
            context_, model_->set_desc(), model_->set(0), false,
            std::max(scene::kLeastOpacity, static_cast<double>(config().opacity_threshold)));
    }

    /// What of the latest prediction is finite and visible. Without outputs_not_finite, weights and inputs are
    /// within what float32 holds; else the Gaussians mean nothing.
    [[nodiscard]] model::Ledger ledger() const { return model_->ledger(); }

    /// Images [n,3,R,R] of the latest prediction, which there must be, of at most kDrawnAtOnce cameras. Errors:
    /// those of raster::pack_views and of the rasterizer.
    Result<std::vector<float>> draw(std::span<const scene::Camera> cameras);

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
    std::unique_ptr<raster::Rasterizer> rasterizer_;  ///< made by the first draw()
};

}  // namespace splat::predict
