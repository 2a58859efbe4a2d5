#pragma once

#include "scene/gaussians.h"

namespace splat::scene {

/// Directions of the axes x, y, z of a scene, seen by a viewer: right or left, up or down, front or
/// back. Scenes in memory are kRdf.
enum class Frame : std::uint8_t {
    kRdf,  ///< 3DGS .ply files, .splat, COLMAP, OpenCV
    kRub,  ///< .spz, OpenGL, three.js
    kLuf,  ///< .gltf and .glb: the specification of glTF has +Z forward, -X right
    kRuf,  ///< Unity
    kLdb,
    kRdb,
    kLub,
    kLdf,
};

/// "RDF" and so on.
const char* frame_name(Frame frame);

/// Express means, rotations and SH bands in the frame `to` instead of `from`. The frames differ in
/// signs of axes only, so two conversions there and back give the same bits.
void convert_frame(Gaussians& gaussians, Frame from, Frame to);

}  // namespace splat::scene
