#pragma once

#include <cstdint>
#include <span>

#include "core/status.h"

namespace splat::prior_scores {

/// How well predicted planes are the true ones; IoU is intersection over union of their pixels.
struct PlaneScores {
    double covering = 0;          ///< mean over the pixels of true planes of their plane's best IoU
    double recall = 0;            ///< share of the true planes that are found
    double precision = 0;         ///< share of the predicted planes that find one; 0 without any
    std::uint64_t pixels = 0;     ///< on true planes
    std::uint64_t predicted = 0;  ///< planes
    std::uint64_t truth = 0;      ///< planes
};

/// Compare two maps of planes. A plane is all pixels with the same four numbers. A predicted plane finds a true one
/// if their IoU is above 0.5, their normals differ by at most `degrees` and their distances by at most `distance`.
///
/// prediction, truth   [height, width, 4]: the normal, of any length, and the distance from the camera; <= 0: no plane
/// Errors     kShape if the sizes differ or are not of 4 channels; kInvalidArgument for numbers that are not finite, a
///            plane without a normal, no true plane, and limits outside of 0 <= distance, 0 <= degrees <= 180
/// Precision  float64
/// Source     covering: Arbelaez et al. 2011, doi:10.1109/TPAMI.2010.161, section 3.1; recall by IoU, normal and
///            offset: Jin et al. 2021, arXiv:2103.14644, section 5
Result<PlaneScores> compare_planes(std::span<const float> prediction, std::span<const float> truth,
                                   double distance, double degrees);

}  // namespace splat::prior_scores
