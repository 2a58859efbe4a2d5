#pragma once

#include <vector>

#include "vkrun/cli/handles.h"

namespace vkrun {

/// The views of an object that an evaluator scores, conditioning ones first.
struct ObjectViews {
    std::uint32_t inputs = 0, side = 0;
    std::vector<std::uint32_t> numbers;  ///< in the data set
    std::vector<splat_camera> cameras;   ///< in the frame of the first
    std::vector<float> images;           ///< [n,3,R,R] targets
};

/// Reads numbers, cameras and images only if `wanted`. Throws a Failure.
ObjectViews read_views(splat_evaluator evaluator, std::uint32_t object, bool wanted);

/// What the evaluator drew of the object that it scored last. Throws a Failure.
std::vector<float> drawn_images(splat_evaluator evaluator, std::uint32_t object,
                                const ObjectViews& views);

}  // namespace vkrun
