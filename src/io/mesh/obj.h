#pragma once

#include "core/status.h"
#include "io/bytes.h"
#include "io/mesh/mesh.h"

namespace splat::io {

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

}  // namespace splat::io
