#pragma once

#include <span>
#include <vector>

#include "core/status.h"
#include "scene/camera.h"

namespace splat::scene {

/// Cameras along a smooth path through `keys`, in their order: cubic Hermite curves of positions and of quaternions,
/// whose slopes at a key are those of the parabola through its neighbours. Steps are about equally long, each by the
/// path's mean distance and mean angle between keys. Poses equal to the one before are left out.
///
/// count        first and last frame are the first and last key; of a closed path the frame after the last one is the
///              first key
/// closed       the path returns to the first key
/// Returns cameras with the size and lens of the first key
/// Errors       kInvalidArgument for fewer than two different poses
/// Precision    float64
Result<std::vector<Camera>> camera_path(std::span<const Camera> keys, std::uint32_t count,
                                        bool closed);

}  // namespace splat::scene
