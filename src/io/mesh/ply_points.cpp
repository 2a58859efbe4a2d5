#include "io/mesh/mesh.h"

#include <algorithm>

#include "io/ply_rows.h"

namespace splat::io {

Result<ColoredPoints> read_ply_colored_points(Bytes file) {
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    const PlyElement* const faces = header.find("face");
    if (faces != nullptr && faces->count > 0)
        return unsupported(
            "PLY: a mesh of %llu faces, expected points alone; write it as .obj, of whose "
            "surface points are drawn: python3 -c \"import trimesh; "
            "trimesh.load('IN.ply').export('OUT.obj')\"",
            llu(faces->count));
    ColoredPoints points;
    PlyRows rows(header, file);
    for (const PlyElement& element : header.elements) {
        if (element.name != "vertex") {
            SPLAT_TRY(rows.skip(element));
            continue;
        }
        const auto found = [&element](const std::array<const char*, 3>& names) {
            std::vector<std::size_t> places;
            for (const char* name : names)
                if (const auto place = element.find(name)) places.push_back(*place);
            return places;
        };
        const std::vector<std::size_t> axes = found({"x", "y", "z"});
        const std::vector<std::size_t> colors = found({"red", "green", "blue"});
        if (axes.size() != 3) return damaged("PLY: the vertices have no x, y and z");
        const bool colored = colors.size() == 3 && std::ranges::all_of(colors, [&](std::size_t at) {
                                 return element.properties[at].type == NumberType::kU8;
                             });
        SPLAT_TRY(rows.need(element));
        points.positions.resize(element.count);
        if (colored) points.colors.resize(element.count);
        SPLAT_TRY(rows.read(element, [&](std::size_t row, const std::vector<double>& values) {
            for (std::size_t k = 0; k < 3; ++k) {
                points.positions[row][k] = values[axes[k]];
                if (colored) points.colors[row][k] = to_byte(values[colors[k]]);
            }
        }));
    }
    if (points.positions.empty()) return damaged("PLY: there is no vertex");
    return points;
}

Result<std::vector<scene::Vec3>> read_ply_points(Bytes file) {
    SPLAT_ASSIGN(ColoredPoints points, read_ply_colored_points(file));
    const auto bad = std::ranges::find_if_not(points.positions, scene::is_finite);
    if (bad != points.positions.end())
        return damaged("PLY: vertex %td is not finite", bad - points.positions.begin());
    return std::move(points.positions);
}

}  // namespace splat::io
