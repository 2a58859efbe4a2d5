#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/status.h"
#include "scene/vector.h"

namespace splat::scene {

using Triangle = std::array<std::uint32_t, 3>;

/// Stands for no texture of a material, and for no normal or texture coordinate of a corner.
inline constexpr std::uint32_t kNone = UINT32_MAX;

/// An image in memory: sRGB and opacity in bytes, rows from the top.
struct Texture {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::array<std::uint8_t, 4>> texels;
};

/// What is outside of 0 to 1.
enum class Wrap : std::uint8_t { kRepeat, kClamp, kMirror };

/// kOpaque: opacity counts nowhere; kMask: a point is there from `alpha_cutoff` on; kBlend: it shows what is behind.
enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// The base colour at a point is color x texture x vertex colour, all linear, with their opacities.
struct MeshMaterial {
    std::array<float, 4> color = {1, 1, 1, 1};  ///< linear, and opacity
    std::uint32_t texture = kNone;
    /// The texture is read at (m0 u + m1 v + m2, m3 u + m4 v + m5), where v grows from the top row down.
    std::array<float, 6> at = {1, 0, 0, 0, 1, 0};
    Wrap wrap_u = Wrap::kRepeat;
    Wrap wrap_v = Wrap::kRepeat;
    bool nearest = false;  ///< texels as they are, not interpolated
    AlphaMode alpha = AlphaMode::kOpaque;
    float alpha_cutoff = 0.5F;
    bool double_sided = true;  ///< false: drawn where its corners turn counterclockwise

    friend bool operator==(const MeshMaterial&, const MeshMaterial&) = default;
};

/// A surface of triangles in the units and axes of its file.
///
/// Corner k of triangle i is vertices[triangles[i][k]], with the normal normals[normal_indices[i][k]] and the texture
/// coordinates texcoords[texcoord_indices[i][k]], unless these are kNone. Where the list of indices is empty, that of
/// the vertices stands for it. Positions have 64 bits, so that a surface far from the origin keeps its shape.
///
/// Memory   24 bytes a vertex, 12 a normal, 8 texture coordinates, 16 a colour; 16 to 40 a triangle
struct TriangleMesh {
    std::vector<Vec3> vertices = {};
    std::vector<Triangle> triangles = {};
    std::vector<std::array<float, 3>> normals = {};    ///< any lengths; 0: not known
    std::vector<std::array<float, 2>> texcoords = {};  ///< u to the right, v from the top down
    std::vector<std::array<float, 4>> colors =
        {};  ///< for each vertex, linear, and opacity; or none
    std::vector<Triangle> normal_indices = {};
    std::vector<Triangle> texcoord_indices = {};
    std::vector<std::uint32_t> material_of = {};  ///< for each triangle; none: all have 0
    std::vector<MeshMaterial> materials = {};     ///< none: all is white
    std::vector<Texture> textures = {};
};

/// What a renderer can rely on: every index names something, lengths fit, vertices and colours are finite. Errors:
/// kInvalidArgument, naming the first that does not, and for a mesh without triangles.
Status check_mesh(const TriangleMesh& mesh);

/// Measures of the vertices that triangles name, in double.
struct MeshMeasures {
    Vec3 low{};  ///< corners of their box
    Vec3 high{};
    double area = 0;              ///< the sum over all triangles
    std::uint64_t zero_area = 0;  ///< triangles without area
    std::uint64_t unused = 0;     ///< vertices that no triangle names
};
MeshMeasures measure(const TriangleMesh& mesh);

/// How large a mesh is made. All but kAsGiven put the centre of its box into the origin.
enum class MeshSize {
    kAsGiven,
    kUnitCube,      ///< the longest side of the box is 1
    kUnitDiagonal,  ///< the diagonal of the box is 1, as in ShapeNet (1.00 for an object in DISN's renders)
    kUnitSphere,    ///< the farthest vertex is at distance 1
};

/// Moves and scales the vertices. Those that no triangle names move, too, but do not count; to the origin, where they
/// would become infinite.
///
/// Errors      kInvalidArgument for a mesh without triangles, of size 0, or of one that is not finite; it stays then
/// Precision   the centre is subtracted in float64: 10^6 units from the origin cost 10^-10 of a unit
Status normalise(TriangleMesh& mesh, MeshSize size);

/// Points on a surface, uniform by area; one number of `seed` and of the point's place decides each.
///
/// Errors       kInvalidArgument for a mesh without triangles, without area or with an area that is not finite
/// Determinism  bit-exact
/// Source       Osada et al. 2002, doi:10.1145/571647.571648, section 4.2
Result<std::vector<Vec3>> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                         std::uint64_t seed);

}  // namespace splat::scene
