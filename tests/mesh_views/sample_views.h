#pragma once

#include <filesystem>

#include "mesh_views/object_writer.h"

namespace splat::test {

/// An object "block" of 3 views, of 4 in other splits, 16 x 16 pixels, 20 points.
mesh_views::ViewsDesc sample_views(const std::filesystem::path& path);

/// Two triangles, the square of side 0.5 in the plane y = 0 around the origin.
scene::TriangleMesh sample_square();

/// Stands for a renderer: a red square in the middle of each view, whose borders are half covered; depth 1, normals
/// towards the camera, a green albedo.
mesh_views::Draw sample_draw(std::uint32_t size);

}  // namespace splat::test
