#pragma once

#include <span>

#include "data/co3d_raw.h"
#include "scene/vector.h"

namespace splat::data {

/// Cameras of a sequence in PyTorch3D's convention: p_camera = p_world R + T.
struct Co3dCameras {
    std::vector<float> rotations;     ///< R, [F,3,3]
    std::vector<float> translations;  ///< T, [F,3]
};

/// Cameras as the release has them.
Co3dCameras stored_cameras(std::span<const RawFrame> frames);

/// In the frame of the published data: the centre of mass of the points is at the origin, y is the normal of the
/// plane in which the cameras' x axes lie (their direction of least variance, up in the first camera), x that of most
/// variance; then the middle of the points' extent along y is at 0, and their greatest coordinate is 0.57. The sign
/// of x is free: here its greatest component is positive.
///
/// Errors   kFormat for less than two cameras, or without points that are finite and not all equal
/// Source   normalisation of CO3D of Viewset Diffusion, with volumes of side 1.2
Result<Co3dCameras> normalised_cameras(std::span<const RawFrame> frames,
                                       std::span<const scene::Vec3> points);

/// x, y and z of the vertices of a .ply file. Errors: as read_file(); kFormat if it has none.
Result<std::vector<scene::Vec3>> read_points(const std::string& path);

}  // namespace splat::data
