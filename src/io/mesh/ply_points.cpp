#include "io/mesh/mesh.h"

#include <cmath>

#include "io/ply_rows.h"

namespace splat::io {

Result<std::vector<scene::Vec3>> read_ply_points(Bytes file) {
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    const PlyElement* const faces = header.find("face");
    if (faces != nullptr && faces->count > 0)
        return unsupported(
            "PLY: a mesh of %llu faces, expected points alone; write it as .obj, of whose "
            "surface points are drawn: python3 -c \"import trimesh; "
            "trimesh.load('IN.ply').export('OUT.obj')\"",
            llu(faces->count));
    std::vector<scene::Vec3> points;
    PlyRows rows(header, file);
    for (const PlyElement& element : header.elements) {
        if (element.name != "vertex") {
            SPLAT_TRY(rows.skip(element));
            continue;
        }
        const std::optional<std::size_t> axes[] = {element.find("x"), element.find("y"),
                                                   element.find("z")};
        for (const auto& axis : axes)
            if (!axis) return damaged("PLY: the vertices have no x, y and z");
        SPLAT_TRY(rows.need(element));
        std::size_t bad = element.count;
        points.resize(element.count);
        SPLAT_TRY(rows.read(element, [&](std::size_t row, const std::vector<double>& values) {
            for (std::size_t k = 0; k < 3; ++k) {
                points[row][k] = values[*axes[k]];
                if (!std::isfinite(points[row][k])) bad = std::min(bad, row);
            }
        }));
        if (bad < element.count) return damaged("PLY: vertex %zu is not finite", bad);
    }
    if (points.empty()) return damaged("PLY: there is no vertex");
    return points;
}

}  // namespace splat::io
