#pragma once

#include <vector>

#include "core/status.h"
#include "io/bytes.h"
#include "scene/vector.h"

namespace splat::io {

/// x, y, z of the vertices of a .ply file, at least one.
///
/// Errors       as parse_ply_header() and PlyRows; kFormat for a vertex that is not finite; kUnsupported for a file
///              with faces, of which vertices are no fair sample
Result<std::vector<scene::Vec3>> read_ply_points(Bytes file);

}  // namespace splat::io
