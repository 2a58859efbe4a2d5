#pragma once

#include <vector>

#include "predict/view_source.h"

namespace splat::predict {

/// How LGM's network sees an object: from cameras around it, whose rays are planes of its input. The world has the axes
/// of the first camera, which looks at its origin from camera_distance().
///
/// Source  Tang et al. 2024, arXiv:2402.05054, section 3.2, and the published code

/// Distance of the first camera from the origin: the middle of data.znear and data.zfar, 1.5 for published weights.
double camera_distance(const config::ModelConfig& network);

/// World-to-camera matrices of as many cameras at equal angles around the object, level with it: from the front, the
/// right, the back and the left for four.
std::vector<scene::Mat4> poses_around(const config::ModelConfig& network, std::uint32_t count);

/// Move the origin of views, relative to the first, there. Cameras are not changed.
void move_origin(const config::ModelConfig& network, Views& views);

/// Append what the network sees of a view, [9,R,R]: the image [3,R,R] as ImageNet's mean and deviation normalise it,
/// o x d, and d, where o and d are the origin and the unit direction of each pixel's ray in the axes right, up, back.
void append_lgm_planes(const config::ModelConfig& network, std::span<const float> image,
                       std::span<const float> view_to_world, std::vector<float>& inputs);

}  // namespace splat::predict
