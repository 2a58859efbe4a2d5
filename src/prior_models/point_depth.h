#pragma once

#include <optional>

#include "prior_models/finish.h"
#include "prior_models/planes.h"

namespace splat::prior_models {

/// Points with their shift, and the camera that sees them.
struct PointDepth {
    Planes depth;
    double focal = 1;   ///< focal length, in halves of the diagonal
    double shift = 0;   ///< s, before the scale
    bool found = true;  ///< false: no focal length above 0 fits, so it is that of kOtherwiseDegrees
};

/// Degrees across the width of the camera where points do not tell it, as MoGe's users take it.
inline constexpr double kOtherwiseDegrees = 60;

/// The distance along the camera's axis of points (x, y, z + s): a model gives them up to the shift s. It is the one
/// for which a pinhole camera with its axis in the middle sees each point best in its own pixel:
///
///   least over s and f:  sum |f (x, y) / (z + s) - (u, v)|^2,   (u, v) in halves of the diagonal
///   f(s) = sum p (u, v) / sum p p,   p = (x, y) / (z + s)
///
/// over 64 x 64 samples. The published search starts from s = 0 and may end behind the barrier at s = -min z, where
/// points lie behind the camera; this one looks only at shifts with all points in front. If f <= 0 there, which no
/// camera has, f is that of kOtherwiseDegrees, and s the best for it. With fewer than two samples f = 1 and s = 0.
/// Where the mask is at most 1/2, or z + s <= 0, the distance is the greatest of the others. Multiplied by the model's
/// scale.
///
/// known   the focal length, if it is known; only s is found then
/// Errors  kInvalidState if no point is valid
/// Source  Wang et al. 2025, MoGe (recover_focal_shift)
Result<PointDepth> point_depth(const Planes& points, const MapSource& source,
                               const std::string& name, std::optional<double> known = {});

}  // namespace splat::prior_models
