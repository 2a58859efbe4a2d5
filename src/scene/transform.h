#pragma once

#include "core/status.h"
#include "scene/gaussians.h"
#include "scene/vector.h"

namespace splat::scene {

/// x -> scale * (rotation x) + translation.
struct Similarity {
    Quaternion rotation = {1, 0, 0, 0};  ///< w, x, y, z; of any length > 0
    Vec3 translation{};
    double scale = 1;  ///< > 0
};

/// Move, turn and scale a scene: means, log scales, rotations and SH bands. The colour seen along
/// (rotation d) afterwards is the one seen along d before.
///
/// Errors       kInvalidArgument for a rotation of length 0, a scale that is not > 0, anything not
///              finite, means that would not stay finite, or arrays that do not fit; the scene is then unchanged
/// Precision    computed in float64, rounded once
Status transform(Gaussians& gaussians, const Similarity& similarity);

}  // namespace splat::scene
