#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "config/model_config.h"
#include "data/planes/plane_channels.h"
#include "gaussians/plane_loss.h"

namespace splat::train {

/// Which Gaussians of an object lie on which plane of its input views, in the order of gaussians::PlaneViews: planes of
/// one view after another, by their first pixels.
struct PlaneMembers {
    std::vector<std::uint32_t> members, begins;
    std::vector<float> normals;  ///< quads
};

/// Pixels of a view with one id are a plane; its normal is that of its first pixel.
///
/// channels       [V,5,R,R] of data::plane_channels
/// view_to_world  [V,4,4] row vectors
/// per_pixel      Gaussians of a pixel, which follow each other
/// Errors         kInvalidArgument, with the view and the pixel: numbers that are not finite, a plane without a normal,
///                more than data::kMostPlanes in a view
Result<PlaneMembers> plane_members(std::span<const float> channels,
                                   std::span<const float> view_to_world, std::size_t pixels,
                                   std::uint32_t per_pixel);

/// The loss of planes (gaussians/plane_loss.h) of an object in training.
///
/// Errors       those of Context::write and run
/// Determinism  bit-exact for any thread count
class ScenePlanes {
  public:
    /// For the object whose Gaussians begin at number `first` of the sets. `value` gets the loss; backward() adds its
    /// gradient times `factor` to `grad`. Errors: kInvalidArgument for a network whose Gaussians are not those of the
    /// pixels of its input.
    static Result<ScenePlanes> create(vk::Context& context, const config::ModelConfig& network,
                                      std::uint32_t first, const gaussians::SetViews& sets,
                                      const gaussians::SetViews& grad, const vk::BufferView& value,
                                      const vk::BufferView& factor);

    Status forward(const PlaneMembers& planes);
    Status backward() { return context_->run(backward_); }

  private:
    explicit ScenePlanes(vk::Context& context) : context_(&context) {}

    vk::Context* context_;
    std::uint32_t first_ = 0;
    vk::Buffer members_, begins_, normals_, offsets_, partial_;
    vk::CommandList forward_, backward_;
};

}  // namespace splat::train
