#pragma once

#include "prior_models/finish.h"
#include "prior_models/planes.h"

namespace splat::prior_models {

/// The distance along the camera's axis of points (x, y, z + s): a model gives them up to the shift s. It is the one
/// for which a pinhole camera with its axis in the middle sees each point best in its own pixel:
///
///   least over s and f:  sum |f (x, y) / (z + s) - (u, v)|^2,   (u, v) in halves of the diagonal
///
/// Where the mask is at most 1/2, the distance is the greatest of the others. Multiplied by the model's scale.
///
/// Errors  kInvalidState if no shift has all points in front of the camera, or no point is valid
/// Source  Wang et al. 2025, MoGe (recover_focal_shift)
Result<Planes> point_depth(const Planes& points, const MapSource& source, const std::string& name);

}  // namespace splat::prior_models
