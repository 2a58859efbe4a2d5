#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/status.h"
#include "scene/camera.h"

namespace splat::prior_scores {

/// The points of the world that a depth map shows, row by row: the pixel in column i and row j sees
/// ((i + 0.5 - cx) / fx, (j + 0.5 - cy) / fy, 1) z in the camera's axes. Pixels with z <= 0 show nothing.
///
/// depth      [height, width] of the camera, z in units of the scene
/// Errors     kShape if the size does not fit; kInvalidArgument for numbers that are not finite
Result<std::vector<scene::Vec3>> points_of_depth(std::span<const float> depth,
                                                 const scene::Camera& camera);

}  // namespace splat::prior_scores
