#pragma once

#include <functional>
#include <span>
#include <vector>

#include "mesh_views/views_desc.h"
#include "scene/triangle_mesh.h"

namespace splat::mesh_views {

/// One view as it is drawn, rows from the top; empty where a map is not written.
struct Drawn {
    std::vector<float> color;   ///< [size,size,3] sRGB, over black
    std::vector<float> alpha;   ///< [size,size] share of each pixel that the object covers
    std::vector<float> depth;   ///< [size,size] along z at the pixel's centre; 0 where nothing is
    std::vector<float> normal;  ///< [size,size,3] there, in the camera's axes; 0 where nothing is
    std::vector<float> albedo;  ///< [size,size,3] colour without light, as color
};

/// Draws the mesh from cameras in its own axes.
using Draw = std::function<Result<std::vector<Drawn>>(std::span<const scene::Camera>)>;

/// True if the object is there. Errors: of check_desc(); kInvalidArgument for a folder of data made with other
/// values, and for an object that another split has.
Result<bool> has_object(const ViewsDesc& desc);

/// Write one object: its views, maps as synthetic::write_object() has them (the mask is `alpha`; the background of
/// depth is behind the mesh's box), and points.ply, on the surface, in the world of the data set. Its folder
/// appears whole or not at all; an existing one is kept.
///
/// Errors        of has_object() and `draw`; kFormat for a mesh without area, and one that no view shows; as
///               io::write_file()
/// Memory        some views at a time, 64 MiB or one
/// Determinism   the same bytes for the same fields, mesh and pictures, for the same zlib
/// Thread-safe   also for the same object at the same time
Status write_object(const ViewsDesc& desc, const scene::TriangleMesh& mesh, const Draw& draw);

}  // namespace splat::mesh_views
