#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/status.h"
#include "io/mesh/mesh.h"
#include "scene/camera.h"

namespace splat::prior_scores {

/// Points on a surface, uniform by area; one number of `seed` and of the point's place decides each.
///
/// Errors       kInvalidArgument for a mesh without triangles, without area or with an area that is not finite
/// Determinism  bit-exact
/// Source       Osada et al. 2002, doi:10.1145/571647.571648, section 4.2
Result<std::vector<scene::Vec3>> sample_surface(const io::Mesh& mesh, std::size_t count,
                                                std::uint64_t seed);

/// The points of the world that a depth map shows, row by row: the pixel in column i and row j sees
/// ((i + 0.5 - cx) / fx, (j + 0.5 - cy) / fy, 1) z in the camera's axes. Pixels with z <= 0 show nothing.
///
/// depth      [height, width] of the camera, z in units of the scene
/// Errors     kShape if the size does not fit; kInvalidArgument for numbers that are not finite
Result<std::vector<scene::Vec3>> points_of_depth(std::span<const float> depth,
                                                 const scene::Camera& camera);

}  // namespace splat::prior_scores
