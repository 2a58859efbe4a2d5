#pragma once

#include <span>

#include "core/status.h"
#include "scene/vector.h"

namespace splat::prior_scores {

/// How far predicted points P lie from the true ones T. d(p, T) is the distance of p to its nearest point in T.
struct PointScores {
    double accuracy = 0;         ///< mean over P of d(p, T)
    double completeness = 0;     ///< mean over T of d(t, P)
    double chamfer = 0;          ///< mean of the two (Mescheder et al. 2019)
    double chamfer_squared = 0;  ///< sum of the means of the squared distances (Fan et al. 2017)
    double precision = 0;        ///< share of P with d(p, T) < threshold
    double recall = 0;           ///< share of T with d(t, P) < threshold
    double f_score = 0;          ///< 2 precision recall / (precision + recall); 0 if both are 0
};

/// Compare two sets of points.
///
/// Errors       kInvalidArgument for a set without points, a point that is not finite, a threshold that is
///              not > 0 and finite
/// Precision    float64, exact nearest neighbours
/// Determinism  bit-exact, with any number of threads
/// Source       Mescheder et al. 2019, doi:10.1109/CVPR.2019.00459; Fan et al. 2017,
///              doi:10.1109/CVPR.2017.264; F-score: Knapitsch et al. 2017, doi:10.1145/3072959.3073599
Result<PointScores> compare_points(std::span<const scene::Vec3> predicted,
                                   std::span<const scene::Vec3> truth, double threshold);

}  // namespace splat::prior_scores
