// The rows of meshes.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr double kFar[12] = {0, 0, 0, 1, 0, 0, NAN, 1, 0, 0, 0, 1};
constexpr std::uint32_t kBeyond[3] = {0, 1, 4};
constexpr float kZeros[24] = {};
constexpr std::uint8_t kTexel[4] = {};

}  // namespace

void MisuseTable::mesh_rows() {
    const auto invalid = wrong_structs<splat_mesh_desc>("splat_mesh_create");
    invalid("no vertices", kArgument, [](auto& d) { d.vertices = nullptr; });
    invalid("no triangles", kArgument, [](auto& d) { d.triangles = nullptr; });
    invalid("none at all", kArgument, [](auto& d) { d.triangle_count = 0; });
    invalid("a part of a vertex", kArgument, [](auto& d) { d.vertex_count = 11; });
    invalid("a part of a triangle", kArgument, [](auto& d) { d.triangle_count = 2; });
    invalid("too many", kArgument, [](auto& d) { d.vertex_count = 3 * (std::uint64_t{1} << 33U); });
    invalid("not finite", kArgument, [](auto& d) { d.vertices = kFar; });
    invalid("of no vertex", kArgument, [](auto& d) {
        d.triangles = kBeyond;
        d.triangle_count = 3;
    });
    for (const auto& [array, count] :
         {std::pair{&splat_mesh_desc::normals, &splat_mesh_desc::normal_count},
          std::pair{&splat_mesh_desc::texcoords, &splat_mesh_desc::texcoord_count},
          std::pair{&splat_mesh_desc::colors, &splat_mesh_desc::color_count}}) {
        invalid("a count without an array", kArgument, [count = count](auto& d) { d.*count = 12; });
        invalid("of other vertices", kArgument, [array = array, count = count](auto& d) {
            d.*array = kZeros;
            d.*count = 24;
        });
    }
    invalid("a texture without texels", kArgument, [](auto& d) { d.texture_count = 4; });
    invalid("a texture without a size", kArgument, [](auto& d) {
        d.texture = kTexel;
        d.texture_count = 4;
    });
    invalid("a texture of another size", kArgument, [](auto& d) {
        d.texture = kTexel;
        d.texture_count = 4;
        d.texture_width = d.texture_height = 2;
    });
    invalid("a colour out of range", kArgument, [](auto& d) { d.base_color[0] = -1; });
    invalid("a flag of reading", kArgument, [](auto& d) { d.flags = SPLAT_MESH_LENIENT; });
    SPLAT_WRONG(splat_mesh_load)
        .each("path", "no file", kNotFound, "/nonexistent/mesh.obj")
        .each("path", "no mesh", kUnsupported, "mesh.png");
    SPLAT_WRONG(splat_mesh_sample)
        .each("count", "a part of a point", kArgument, 4)
        .given("count", 4)
        .each("seed", "any, of a part of a point", kArgument, UINT64_MAX);
    const auto drawn = wrong_structs<splat_mesh_render_desc>("splat_mesh_render");
    drawn("samples of no power of two", kArgument, [](auto& d) { d.samples = 3; });
    drawn("a background out of range", kArgument, [](auto& d) { d.background[2] = 2; });
    drawn("up is not finite", kArgument, [](auto& d) { d.up[1] = INFINITY; });
    drawn("near_plane is negative", kArgument, [](auto& d) { d.near_plane = -1; });
    drawn("a flag of reading", kArgument, [](auto& d) { d.flags = SPLAT_MESH_LENIENT; });
    const auto render = SPLAT_WRONG(splat_mesh_render);
    render.each("cameras", "NULL", kArgument, nullptr)
        .each("cameras", "all zeros", kArgument, splat_camera{})
        .each("maps", "NULL", kArgument, nullptr)
        .each("maps", "none wanted", kArgument, splat_mesh_maps{})
        .each("count", "0: nothing to draw", SPLAT_OK, 0U);
    const auto maps = wrong_structs<splat_mesh_maps>("splat_mesh_render", "maps");
    maps("another size", kShape, [](auto& m) { m.color.width = 15; });
    maps("two channels", kShape, [](auto& m) { m.color.channels = 2; });
    maps("bytes for depth", kArgument, [](auto& m) {
        m.depth = m.color;
        m.depth.channels = 1;
    });
    maps("bytes for normals", kArgument, [](auto& m) { m.normal = m.color; });
    maps("a mask of three channels", kShape, [](auto& m) { m.mask = m.color; });
    maps("no type", kArgument, [](auto& m) { m.color.type = 0; });
    for (const char* function : {"splat_mesh_find_views", "splat_mesh_write_views"})
        mesh_views_rows(wrong_structs<splat_mesh_views_desc>(function));
    wrong_structs<splat_mesh_views_desc>("splat_mesh_write_views")(
        "a path that cannot be written", kNotFound, [](auto& d) { d.path = "/proc/x"; });
}

void MisuseTable::mesh_views_rows(const WrongStructs<splat_mesh_views_desc>& invalid) {
    invalid("no path", kArgument, [](auto& d) { d.path = nullptr; });
    invalid("no name", kArgument, [](auto& d) { d.name = nullptr; });
    invalid("a path as the name", kArgument, [](auto& d) { d.name = "a/b"; });
    invalid("a path as the category", kArgument, [](auto& d) { d.category = ".."; });
    invalid("another layout", kArgument, [](auto& d) { d.layout = "tables"; });
    invalid("another split", kArgument, [](auto& d) { d.split = "x"; });
    invalid("a small size", kArgument, [](auto& d) { d.size = 7; });
    invalid("a large size", kUnsupported, [](auto& d) { d.size = 2049; });
    invalid("many views", kArgument, [](auto& d) { d.train_views = 100001; });
    invalid("many views of tests", kArgument, [](auto& d) { d.test_views = UINT32_MAX; });
    invalid("samples of no power of two", kArgument, [](auto& d) { d.samples = 3; });
    invalid("many points", kArgument, [](auto& d) { d.points = UINT32_MAX; });
    invalid("another protocol", kArgument, [](auto& d) { d.protocol = 3; });
    invalid("another background", kArgument, [](auto& d) { d.background = -1; });
    invalid("a negative distance", kArgument, [](auto& d) { d.distance = -1; });
    invalid("a wide field of view", kArgument, [](auto& d) { d.fov_x = 3; });
    invalid("an elevation of the pole", kArgument, [](auto& d) { d.elevation = 1.57; });
    invalid("jitter is no number", kArgument, [](auto& d) { d.jitter = NAN; });
    invalid("a negative exposure", kArgument, [](auto& d) { d.exposure = -1; });
}

}  // namespace splat::test
