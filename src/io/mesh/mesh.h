#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/decode_budget.h"
#include "core/status.h"
#include "io/bytes.h"
#include "io/colored_points.h"
#include "scene/triangle_mesh.h"

namespace splat::io {

struct MeshOptions {
    std::uint64_t max_triangles = 100'000'000;
    std::uint64_t max_texels = 1ULL << 27U;  ///< in all textures, 4 bytes each
    bool surface_only = false;  ///< vertices and triangles; what looks depend on is not read
    bool lenient = false;       ///< textures and materials that cannot be read are left out
    /// Where the files are that a mesh names; nothing: such files are refused.
    std::optional<std::string> folder = std::nullopt;
    DecodeLimits limits = decode_limits();
};

struct LoadedMesh {
    scene::TriangleMesh mesh;
    std::set<std::string> ignored;  ///< what the file says besides, and what was left out
};

/// The surface of an OBJ file: `v`, and `f` with any number of corners, as v, v/t, v//n or v/t/n; negative indices
/// count from the latest vertex backwards. Polygons become fans of triangles around their first corner, which is exact
/// for convex ones. Three numbers behind x, y, z are a colour, as MeshLab writes it. Materials come from the files of
/// `mtllib`: Kd, d, Tr, map_Kd with -s, -o and -clamp, and map_d if it is the same image; the format says nothing of
/// sides, so all are double-sided. Colours are taken for sRGB. Lines, points, groups and smoothing are left out.
///
/// Memory       counted before it is taken: lines of the file decide; textures as options.max_texels
/// Errors       kFormat, naming the line: an unknown keyword, no number, a vertex that is not finite, a face of fewer
///              than 3 corners, an index of nothing, a material of no file; kUnsupported for curves, free-form surfaces
///              and continued lines, and above the limits; kNotFound for a file that is named. With options.lenient the
///              last one, images that cannot be read and materials of no file are listed in `ignored`
/// Source       Wavefront Technologies, Advanced Visualizer Manual, appendices B1 and B2
Result<LoadedMesh> read_obj(Bytes file, const MeshOptions& options = {});

/// The triangles of a .gltf or .glb file, as the scene that is shown first places them: indexed or not, strips and
/// fans, positions of any type of KHR_mesh_quantization, COLOR_0, base colours and their textures with
/// KHR_texture_transform, EXT_texture_webp, and the diffuse ones of KHR_materials_pbrSpecularGlossiness. Skins and
/// morph targets are left out: a mesh has the shape of its positions. Nodes that mirror keep what is in front.
///
/// Memory       counted before it is taken, over all nodes
/// Errors       kFormat, naming primitive and place: as the reader of Gaussians, an index of no vertex, positions that
///              are not finite; kUnsupported for compressed meshes, instances of extensions, sparse indices, other
///              required extensions, and above the limits; kNotFound for a file that is named. With options.lenient
///              images that cannot be read are listed in `ignored`
/// Source       Khronos Group, glTF 2.0
Result<LoadedMesh> read_gltf_mesh(Bytes file, const MeshOptions& options = {});

/// The mesh of a .obj, .glb or .gltf file, by its name; options.folder becomes its folder.
///
/// Errors       as read_file() and the readers, with the path; kUnsupported for another extension; kFormat for a mesh
///              without triangles
Result<LoadedMesh> load_mesh(const std::string& path, MeshOptions options = {});

/// x, y, z of the vertices of a .ply file, at least one.
///
/// Errors       as parse_ply_header() and PlyRows; kFormat for a vertex that is not finite; kUnsupported for a file
///              with faces, of which vertices are no fair sample
Result<std::vector<scene::Vec3>> read_ply_points(Bytes file);

/// The same with red, green and blue, if all are there and bytes. Errors: the same, but vertices need not be finite.
Result<ColoredPoints> read_ply_colored_points(Bytes file);

}  // namespace splat::io
