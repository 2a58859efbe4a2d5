#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/status.h"
#include "io/bytes.h"
#include "io/colored_points.h"

namespace splat::io {

/// Triangles in the units and axes of their file. Every index is below vertices.size().
struct Mesh {
    std::vector<scene::Vec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// The surface of an OBJ file: `v`, and `f` with any number of corners, as v, v/t, v//n or v/t/n; negative
/// indices count from the latest vertex backwards. Polygons become fans of triangles around their first
/// corner, which is exact for convex ones. Texture coordinates, normals, groups, materials, lines and points
/// are left out, and so are numbers behind x, y, z.
///
/// Errors       kFormat, naming the line: an unknown keyword, no number, a number that is not finite, a face
///              of fewer than 3 corners, an index of no vertex; kUnsupported for curves, free-form surfaces
///              and continued lines
/// Source       Wavefront Technologies, Advanced Visualizer Manual, appendix B1
Result<Mesh> read_obj(Bytes file);

/// x, y, z of the vertices of a .ply file, at least one.
///
/// Errors       as parse_ply_header() and PlyRows; kFormat for a vertex that is not finite; kUnsupported for a file
///              with faces, of which vertices are no fair sample
Result<std::vector<scene::Vec3>> read_ply_points(Bytes file);

/// The same with red, green and blue, if all are there and bytes. Errors: the same, but vertices need not be finite.
Result<ColoredPoints> read_ply_colored_points(Bytes file);

}  // namespace splat::io
