// OBJ: every index of an accepted mesh names a vertex, and every vertex is finite.

#include "fuzz/target.h"
#include "io/mesh/mesh.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto read = io::read_obj(file);
    if (!fuzz::accepted(read.status())) return;
    const io::Mesh& mesh = read.value();
    for (const scene::Vec3& vertex : mesh.vertices) fuzz::require(scene::is_finite(vertex));
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t index : triangle) fuzz::require(index < mesh.vertices.size());
}
