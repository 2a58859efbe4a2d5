// Meshes: files, arrays, sizes, points, pictures.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "api/raster_calls.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::test {
namespace {

splat_mesh_info info_of(const Mesh& mesh) {
    auto info = sized<splat_mesh_info>();
    EXPECT_DONE(splat_mesh_get_info(mesh, &info));
    return info;
}

/// A file in a folder of this process, which goes with it.
class MeshFolder {
  public:
    MeshFolder() { std::filesystem::create_directories(folder_); }
    ~MeshFolder() { std::filesystem::remove_all(folder_); }
    MeshFolder(const MeshFolder&) = delete;
    MeshFolder& operator=(const MeshFolder&) = delete;
    [[nodiscard]] std::string write(const char* name, const char* text) const {
        const std::string path = (folder_ / name).string();
        std::ofstream(path) << text;
        return path;
    }

  private:
    std::filesystem::path folder_ =
        std::filesystem::temp_directory_path() / ("splat-mesh-" + process_text());
};

constexpr const char* kObj =
    "mtllib a.mtl\nusemtl red\nv 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 0\nf 1 2 3 4\n";

TEST(ApiMesh, LoadsMeasuresAndNormalises) {
    const MeshFolder files;
    static_cast<void>(files.write("a.mtl", "newmtl red\nKd 1 0 0\n"));
    const std::string path = files.write("a.obj", kObj);
    const Mesh mesh = got(splat_mesh_load, path.c_str(), nullptr);
    splat_mesh_info info = info_of(mesh);
    EXPECT_EQ(info.vertices, 4U);
    EXPECT_EQ(info.triangles, 2U);
    EXPECT_EQ(info.materials, 2U) << "red, and that of faces without one";
    EXPECT_EQ(info.area, 8);
    EXPECT_EQ(info.high[0], 4);
    EXPECT_GT(info.device_bytes, 4U * 16);
    EXPECT_DONE(splat_mesh_normalise(mesh, SPLAT_MESH_AS_GIVEN));
    EXPECT_EQ(info_of(mesh).high[0], 4);
    EXPECT_DONE(splat_mesh_normalise(mesh, SPLAT_MESH_UNIT_CUBE));
    info = info_of(mesh);
    EXPECT_EQ(info.low[0], -0.5);
    EXPECT_EQ(info.high[1], 0.25);
    char text[64];
    EXPECT_DONE(splat_mesh_load_report(mesh, text, sizeof text, nullptr));
    EXPECT_STREQ(text, "{\"warnings\": []}");
    std::filesystem::remove(std::filesystem::path(path).replace_filename("a.mtl"));
    EXPECT_REFUSED(splat_mesh_load(path.c_str(), nullptr, Output<splat_mesh>().out()), kNotFound,
                   "a.mtl");
}

TEST(ApiMesh, SamplesAsOfAFile) {
    const MeshFolder files;
    const std::string path = files.write("b.obj", "v 0 0 0\nv 4 0 0\nv 4 2 0\nf 1 2 3\n");
    const Mesh mesh = got(splat_mesh_load, path.c_str(), nullptr);
    float points[30], of_file[30];
    EXPECT_DONE(splat_mesh_sample(mesh, 5, points, 30));
    EXPECT_DONE(splat_points_from_mesh(path.c_str(), 5, of_file, 30));
    EXPECT_TRUE(std::ranges::equal(points, of_file));
    EXPECT_DONE(splat_mesh_sample(mesh, 5, nullptr, 0));
}

TEST(ApiMesh, DrawsMaps) {
    const Mesh mesh = make_mesh();
    // At the origin, looking along z: the square from -1 to 1 at z = 3 has 8 x 8 of 16 x 12 pixels.
    const splat_camera camera{
        16, 12, 12, 12, 8, 6, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    std::vector<std::uint8_t> color(std::size_t{16} * 12 * 4), mask(std::size_t{16} * 12);
    std::vector<float> depth(std::size_t{16} * 12), normal(std::size_t{16} * 12 * 3);
    splat_mesh_maps maps{};
    maps.color = {color.data(), color.size(), SPLAT_PIXEL_U8, 16, 12, 4, 0, 0, 0};
    maps.mask = {mask.data(), mask.size(), SPLAT_PIXEL_U8, 16, 12, 1, 0, 0, 0};
    maps.depth = {depth.data(), 4 * depth.size(), SPLAT_PIXEL_F32, 16, 12, 1, 0, 0, 0};
    maps.normal = {normal.data(), 4 * normal.size(), SPLAT_PIXEL_F32, 16, 12, 3, 0, 0, 0};
    auto desc = sized<splat_mesh_render_desc>();
    desc.flags = SPLAT_MESH_UNLIT;
    desc.background[2] = 1;
    EXPECT_DONE(splat_mesh_render(mesh, shared_device(), &camera, 1, &desc, &maps));
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const bool inside = i % 16 >= 4 && i % 16 < 12 && i / 16 >= 2 && i / 16 < 10;
        EXPECT_NEAR(depth[i], inside ? 3 : 0, 1e-6) << i;
        EXPECT_EQ(mask[i], inside ? 255 : 0);
        EXPECT_EQ(color[4 * i], inside ? 255 : 0);
        EXPECT_EQ(color[4 * i + 2], 255);
        EXPECT_EQ(color[4 * i + 3], mask[i]);
        EXPECT_NEAR(normal[3 * i + 2], inside ? -1 : 0, 1e-6);
    }
}

TEST(ApiMesh, ATextureIsSeenOnOneSide) {
    splat_mesh_desc desc = mesh_desc();
    const float texcoords[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    const std::uint8_t texel[4] = {10, 20, 30, 255};
    desc.texcoords = texcoords;
    desc.texcoord_count = 8;
    desc.texture = texel;
    desc.texture_count = 4;
    desc.texture_width = desc.texture_height = 1;
    desc.flags = SPLAT_MESH_SINGLE_SIDED;
    const Mesh mesh = got(splat_mesh_create, &desc);
    EXPECT_EQ(info_of(mesh).texels, 1U);
    splat_camera camera{3, 3, 2, 2, 1.5, 1.5, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    std::uint8_t albedo[27] = {};
    splat_mesh_maps maps{};
    maps.albedo = {albedo, sizeof albedo, SPLAT_PIXEL_U8, 3, 3, 3, 0, 0, 0};
    EXPECT_DONE(splat_mesh_render(mesh, shared_device(), &camera, 1, nullptr, &maps));
    EXPECT_EQ(albedo[12], 10);
    EXPECT_EQ(albedo[14], 30);
    // From behind, turned about y.
    const double behind[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 6, 0, 0, 0, 1};
    std::ranges::copy(behind, camera.world_to_camera);
    EXPECT_DONE(splat_mesh_render(mesh, shared_device(), &camera, 1, nullptr, &maps));
    EXPECT_EQ(albedo[12], 0);
}

}  // namespace
}  // namespace splat::test
