#pragma once

#include <vector>

#include "vkrun/cli/handles.h"

namespace vkrun {

/// A depth map and how opaque each pixel is.
struct Depth {
    std::vector<float> depth, alpha;  ///< [R,R]
};

/// Images [n,3,R,R] of a scene, on a background.
std::vector<float> draw_scene(splat_device device, const Scene& scene,
                              const std::vector<splat_camera>& cameras, const float* background,
                              splat_convention convention = 0);

/// Expected depth along z, and how opaque each pixel is.
Depth draw_scene_depth(splat_device device, const Scene& scene, const splat_camera& camera,
                       const float* background, splat_convention convention);

}  // namespace vkrun
