#pragma once

#include <span>
#include <vector>

#include "config/model_config.h"

namespace splat::model {

/// Directions [3,R,R] of the pixels' rays: x right, y down for the default inverted_y. Not divided by the
/// focal length if each view has its own.
std::vector<float> pixel_rays(const config::ModelConfig& config);

/// Values that modulate the network's blocks as sines and cosines (positional_embedding): per view the camera's
/// position and viewing axis, [views, 6] from matrices [views,4,4], or the index of the view there, [images, 1].
std::vector<float> pose_scalars(std::span<const float> view_to_world);
std::vector<float> index_scalars(const config::ModelConfig& config, std::uint32_t images);

}  // namespace splat::model
