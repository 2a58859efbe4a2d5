#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace splat::prior_models {

/// The pinhole camera of a depth map, pixels; the middle of the first pixel is at 1/2.
struct DepthCamera {
    std::uint32_t width = 0, height = 0;
    double focal_x = 0, focal_y = 0;
    double center_x = 0, center_y = 0;
};

/// Unit normals of the surface that a depth map shows, facing the camera, in its axes (x right, y down, z forward):
///
///   p = z ((x - cx) / fx, (y - cy) / fy, 1),   n = -(p_x cross p_y) / |p_x cross p_y|
///
/// where p_x and p_y are differences with the neighbour whose distance differs less, so that edges do not
/// bend the surface beside them.
///
/// depth   [height,width] distances along the axis; 0 or less, or not finite: no surface, whose normal is 0
/// Returns [height,width,3]
std::vector<float> normals_of(std::span<const float> depth, const DepthCamera& camera);

/// Distances of relative depth v: 1 / (1 / farthest + v (1 / nearest - 1 / farthest)).
void distances_of(std::vector<float>& depth, double nearest, double farthest);

}  // namespace splat::prior_models
