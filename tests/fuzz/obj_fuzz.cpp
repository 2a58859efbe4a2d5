// OBJ: an accepted mesh keeps what a renderer relies on, and its surface alone is the same.

#include "fuzz/target.h"
#include "io/mesh/mesh.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    io::MeshOptions options;
    options.surface_only = true;
    const auto surface = io::read_obj(file, options);
    if (fuzz::accepted(surface.status()))
        for (const scene::Vec3& vertex : surface.value().mesh.vertices)
            fuzz::require(scene::is_finite(vertex));
    options.surface_only = false;
    options.lenient = true;  // materials are files
    const auto read = io::read_obj(file, options);
    if (!fuzz::accepted(read.status())) return;
    const scene::TriangleMesh& mesh = read.value().mesh;
    fuzz::require(mesh.triangles.empty() || scene::check_mesh(mesh).ok());
    fuzz::require(surface.ok() && surface.value().mesh.triangles == mesh.triangles);
}
