#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/status.h"
#include "scene/vector.h"

namespace splat::data {

/// A camera in the axes of another one.
struct RelativeView {
    std::array<float, 16>
        view_to_world{};                ///< row vectors: p_world = p_view M; last column 0 0 0 1
    std::array<float, 4> quaternion{};  ///< w, x, y, z of the rotation, w >= 0
};

/// Cameras relative to the first of them, which becomes the identity: the world is its frame.
///
/// camera_to_world   row-major, column vectors, OpenCV axes (x right, y down, z forward)
/// Errors            kFormat for a pose that is singular or not finite
/// Precision         computed in float64, rounded once; a pose equal to the first gives exactly 1 and 0
/// Source            make_poses_relative_to_first and matrix_to_quaternion of Splatter Image; unlike the
///                   latter it keeps its precision near 180 degrees, without changes of sign
Result<std::vector<RelativeView>> relative_views(std::span<const scene::Mat4> camera_to_world);

/// Scale the world so that the first camera is at this distance from the origin. Errors: kFormat if that
/// camera is at the origin.
Status scale_to_distance(double distance, std::span<scene::Mat4> camera_to_world);

/// Quaternion w, x, y, z with w >= 0 of a rotation matrix.
scene::Quaternion quaternion_of(const scene::Mat3& rotation);

/// Distance of the world's origin in front of a camera, along its axis: about that of CO3D's objects.
double origin_distance(const scene::Mat4& camera_to_world);

}  // namespace splat::data
