#pragma once

#include <span>
#include <vector>

#include "config/model_config.h"
#include "data/photograph.h"

namespace splat::predict {

/// Depths in scene units from a map's numbers of 0 to 1, in place. Where larger is `farther`, 0 is data.znear, 1
/// data.zfar, and depths between are linear, as F3D-Gaus has them. Where larger is nearer, 0 is data.zfar, 1
/// data.znear, and inverse depths are linear.
void to_scene_depths(const config::ModelConfig& network, bool farther, std::span<float> numbers);

/// The depths [R,R] of a picture taken whole: the map's central square, resampled by Lanczos' kernel, its least as 0
/// and its greatest as 1. model.head.depth_maps says what larger is.
///
/// Errors   kInvalidArgument with the map's name: other sides than the image's, in proportion, or one number everywhere
/// Source   W-Ted/F3D-Gaus 8e52aec, norm_depth_to01 of its demonstration
Result<std::vector<float>> head_depths(const config::ModelConfig& network,
                                       const data::NamedImage& map, const io::Image& image);

}  // namespace splat::predict
