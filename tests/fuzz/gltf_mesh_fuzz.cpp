// Meshes of glTF: an accepted one keeps what a renderer relies on, and its surface alone is the same.

#include "fuzz/gltf_repair.h"
#include "fuzz/target.h"
#include "io/mesh/mesh.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    io::MeshOptions options;
    options.max_triangles = 4096;
    options.max_texels = 4096;
    const auto read = io::read_gltf_mesh(file, options);
    if (!fuzz::accepted(read.status())) return;
    const scene::TriangleMesh& mesh = read.value().mesh;
    fuzz::require(scene::check_mesh(mesh).ok());
    options.surface_only = true;
    const auto surface = io::read_gltf_mesh(file, options);
    fuzz::require(surface.ok() && surface.value().mesh.triangles.size() == mesh.triangles.size());
    const scene::MeshMeasures measures = scene::measure(mesh);
    scene::TriangleMesh unit = surface.value().mesh;
    if (scene::normalise(unit, scene::MeshSize::kUnitCube).ok())
        fuzz::require(scene::check_mesh(unit).ok());
    fuzz::require(measures.zero_area <= mesh.triangles.size());
}

SPLAT_FUZZ_MUTATOR(fuzz::repair_glb)
