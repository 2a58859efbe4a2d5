#include <gtest/gtest.h>

#include <filesystem>

#include "io/file.h"
#include "io/image.h"
#include "io/mesh/mesh.h"
#include "io/mesh/textures.h"
#include "io/sample_files.h"
#include "scene/srgb.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::io {
namespace {

using namespace test;
using scene::AlphaMode;
using scene::kNone;
using scene::MeshMaterial;
using scene::TriangleMesh;
using scene::Wrap;

/// A PNG of 2 x 1 pixels, or of others: the first is red, the others are 10, 20, 30 with this opacity.
Buffer small_png(std::uint32_t channels = 3, std::uint16_t opacity = 255, std::uint32_t width = 2) {
    Image image{width, 1, channels, 8, {}};
    for (std::uint32_t i = 0; i < width; ++i)
        for (std::uint32_t k = 0; k < channels; ++k)
            image.samples.push_back(
                k == 3 ? opacity
                       : static_cast<std::uint16_t>(i == 0 ? (k == 0 ? 255 : 0) : 10 * (k + 1)));
    return need(write_png(image));
}

constexpr const char* kSquare =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 0.25\n";

class ObjLooks : public FolderTest {
  protected:
    void put(const std::string& name, const std::string& text) {
        std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
        EXPECT_OK(write_file(path(name), as_bytes(text)));
    }
    void put_image(const std::string& name, const Buffer& file) {
        std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
        EXPECT_OK(write_file(path(name), file));
    }
    Result<LoadedMesh> load(const std::string& obj, const MeshOptions& options = {}) {
        put("m/a.obj", obj);
        return load_mesh(path("m/a.obj"), options);
    }
};

TEST_F(ObjLooks, GroupsHaveTheirMaterials) {
    put("m/a.mtl",
        "# two\nnewmtl red\nKd 1 0.5 0\nKa 0 0 0\nillum 2\nnewmtl glass\nKd 0.2\nd 0.25\n"
        "newmtl mist\nTr 0.25\nmap_Kd tex/t.png\nnewmtl unused\nmap_Kd missing.png\n");
    put_image("m/tex/t.png", small_png());
    const LoadedMesh loaded =
        need(load(std::string("mtllib a.mtl\n") + kSquare +
                  "f 1 2 3\nusemtl glass\nf 1 2 3\nf 1 2 4\nusemtl red\nf 1/1 2/2 3/3 4/4\n"
                  "usemtl mist\nf 1/-1 2/-2 3/-3\n"));
    const TriangleMesh& mesh = loaded.mesh;
    ASSERT_OK(scene::check_mesh(mesh));
    EXPECT_EQ(mesh.material_of, (std::vector<std::uint32_t>{0, 1, 1, 2, 2, 3}));
    ASSERT_EQ(mesh.materials.size(), 4U);
    EXPECT_EQ(mesh.materials[0], MeshMaterial());
    const float fifth = scene::linear_of_srgb(0.2F);
    EXPECT_EQ(mesh.materials[1].color, (std::array<float, 4>{fifth, fifth, fifth, 0.25F}));
    EXPECT_EQ(mesh.materials[1].alpha, AlphaMode::kBlend);
    EXPECT_EQ(mesh.materials[2].color,
              (std::array<float, 4>{1, scene::linear_of_srgb(0.5F), 0, 1}));
    EXPECT_EQ(mesh.materials[2].alpha, AlphaMode::kOpaque);
    EXPECT_EQ(mesh.materials[2].texture, kNone);
    EXPECT_EQ(mesh.materials[3].color[3], 0.75F);
    EXPECT_EQ(mesh.materials[3].texture, 0U);
    EXPECT_TRUE(mesh.materials[3].double_sided);
    ASSERT_EQ(mesh.textures.size(), 1U);
    EXPECT_EQ(mesh.textures[0].width, 2U);
    EXPECT_EQ(mesh.textures[0].texels[0], (std::array<std::uint8_t, 4>{255, 0, 0, 255}));
    EXPECT_EQ(mesh.textures[0].texels[1], (std::array<std::uint8_t, 4>{10, 20, 30, 255}));
    // v grows downwards in memory; corners without coordinates have none.
    EXPECT_EQ(mesh.texcoords[3], (std::array<float, 2>{0, 0.75F}));
    EXPECT_EQ(mesh.texcoord_indices[0], (scene::Triangle{kNone, kNone, kNone}));
    EXPECT_EQ(mesh.texcoord_indices[4], (scene::Triangle{0, 2, 3}));
    EXPECT_EQ(mesh.texcoord_indices[5], (scene::Triangle{3, 2, 1}));
    EXPECT_TRUE(loaded.ignored.contains("material's Ka"));
}

TEST_F(ObjLooks, OptionsOfImages) {
    const auto material_of = [](const std::string& line) {
        std::set<std::string> ignored;
        const auto read = need(read_mtl(as_bytes("newmtl a\n" + line + "\n"), ignored));
        return read.at(0);
    };
    const auto plain = material_of("map_Kd a b.png");
    EXPECT_EQ(plain.image, "a b.png");
    EXPECT_EQ(plain.material.at, MeshMaterial().at);
    const auto moved =
        material_of("map_Kd -s 2 4 -blendu on -o 0.5 0.25 1 -clamp on -mm 0 1 t.png");
    EXPECT_EQ(moved.image, "t.png");
    EXPECT_EQ(moved.material.wrap_u, Wrap::kClamp);
    // In the file u' = 2 u + 0.5 and w' = 4 w + 0.25, where v = 1 - w.
    EXPECT_EQ(moved.material.at, (std::array<float, 6>{2, 0, 0.5F, 0, 4, 1 - 4 - 0.25F}));
    EXPECT_EQ(material_of("map_Kd t.png\nmap_d t.png").material.alpha, AlphaMode::kMask);
    EXPECT_EQ(material_of("map_Kd t.png\nmap_d u.png").material.alpha, AlphaMode::kOpaque);
}

TEST(Mtl, ErrorsNameTheLine) {
    const std::pair<const char*, const char*> cases[] = {
        {"Kd 1 1 1\n", "MTL line 1: 'Kd' stands before the first newmtl"},
        {"newmtl\n", "MTL line 1: there is no name"},
        {"newmtl a\nKd 1 2 0\n", "MTL line 2: a colour is 2, expected 0 to 1"},
        {"newmtl a\nKd 1 nan 0\n", "MTL line 2: colour is not finite"},
        {"newmtl a\nKd x\n", "MTL line 2: colour is 'x'"},
        {"newmtl a\nd -1\n", "MTL line 2: an opacity is -1"},
        {"newmtl a\nmap_Kd\n", "MTL line 2: there is no name of an image"},
        {"newmtl a\nmap_Kd -s 1 1 1\n", "MTL line 2: there is no name of an image"},
        {"newmtl a\nmap_Kd -x 1 t.png\n", "MTL line 2: an option of the image is '-x'"},
        {"newmtl a\nmap_Kd -s inf t.png\n", "MTL line 2: an option of the image is not finite"},
    };
    for (const auto& [text, sentence] : cases) {
        std::set<std::string> ignored;
        EXPECT_ERROR(read_mtl(as_bytes(text), ignored), Code::kFormat, sentence) << text;
    }
}

TEST_F(ObjLooks, MissingPartsAreRefusedOrListed) {
    const std::string start = std::string("mtllib a.mtl\n") + kSquare + "usemtl x\nf 1/1 2/2 3/3\n";
    MeshOptions lenient;
    lenient.lenient = true;
    const auto both = [&](Code code, const char* sentence) {
        EXPECT_ERROR(load(start), code, sentence);
        const LoadedMesh loaded = need(load(start, lenient));
        ASSERT_OK(scene::check_mesh(loaded.mesh));
        bool listed = false;
        for (const std::string& line : loaded.ignored)
            listed = listed || line.find(sentence) != std::string::npos;
        EXPECT_TRUE(listed) << sentence;
    };
    both(Code::kNotFound, "mtllib 'a.mtl'");
    put("m/a.mtl", "newmtl y\nKd 1 0 0\n");
    both(Code::kFormat, "the material 'x' is in none of the 1 files");
    put("m/a.mtl", "newmtl x\nmap_Kd no.png\n");
    both(Code::kNotFound, "OBJ: material 'x', map_Kd 'no.png'");
    put("m/a.mtl", "newmtl x\nmap_Kd bad.png\n");
    put("m/bad.png", "no image");
    both(Code::kFormat, "map_Kd 'bad.png': not a PNG");
    put("m/a.mtl", "newmtl x\nmap_Kd ../../out.png\n");
    both(Code::kFormat, "'../../out.png' leads elsewhere");
    put("m/a.mtl", "newmtl x\nmap_Kd C:\\textures\\a.png\n");
    both(Code::kFormat, "without a drive");
    put("m/a.mtl", "newmtl x\nmap_Kd wide.png\n");
    put_image("m/wide.png", small_png(3, 0, 3000));
    lenient.max_texels = 2999;
    const LoadedMesh loaded = need(load(start, lenient));
    EXPECT_TRUE(loaded.mesh.textures.empty());
    lenient.lenient = false;
    EXPECT_ERROR(load(start, lenient), Code::kUnsupported,
                 "3000 x 1 texels, but all textures of a mesh may have 2999, of which 2999 are");
    EXPECT_OK(load(start));

    EXPECT_ERROR(read_obj(as_bytes(start)), Code::kUnsupported, "the mesh is read from memory");
    MeshOptions bare;
    bare.surface_only = true;
    EXPECT_OK(read_obj(as_bytes(start), bare));
    EXPECT_ERROR(load("v 0 0 0\n"), Code::kFormat, "the mesh has no faces");
    EXPECT_ERROR(load_mesh(path("m/a.stl")), Code::kUnsupported, "expected as .obj, .glb or .gltf");
    EXPECT_ERROR(load_mesh(path("m/b.obj")), Code::kNotFound, "b.obj");
}

TEST_F(ObjLooks, FilesLieWhereShapeNetHasThem) {
    put("m/a b.mtl", "newmtl x\nmap_Kd ..\\images\\t.png\n");
    put_image("images/t.png", small_png(4, 128));
    const LoadedMesh loaded =
        need(load(std::string("mtllib a b.mtl\n") + kSquare + "usemtl x\nf 1/1 2/2 3/3\n"));
    ASSERT_EQ(loaded.mesh.textures.size(), 1U);
    EXPECT_EQ(loaded.mesh.textures[0].texels[1][3], 128);
    put("m/one.mtl", "newmtl x\nKd 1 0 0\n");
    put("m/two.mtl", "newmtl y\nKd 0 1 0\n");
    const LoadedMesh two = need(load(std::string("mtllib one.mtl two.mtl\n") + kSquare +
                                     "usemtl x\nf 1 2 3\nusemtl y\nf 1 2 4\n"));
    EXPECT_EQ(two.mesh.materials[2].color, (std::array<float, 4>{0, 1, 0, 1}));
}

TEST_F(ObjLooks, NoLinkIsFollowed) {
    SPLAT_NEED_LINKS(path(""));
    put_image("t.png", small_png());
    put("m/a.mtl", "newmtl x\nmap_Kd t.png\n");
    std::filesystem::create_symlink(path("t.png"), path("m/t.png"));
    EXPECT_ERROR(load(std::string("mtllib a.mtl\n") + kSquare + "usemtl x\nf 1 2 3\n"),
                 Code::kFormat, "symbolic link");
}

TEST(ObjVertices, ColoursStandBehindCoordinates) {
    const auto mesh = need(read_obj(as_bytes("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 0 0 0 0.5\n"
                                             "f 1 2 3\n")))
                          .mesh;
    ASSERT_EQ(mesh.colors.size(), 3U);
    EXPECT_EQ(mesh.colors[0], (std::array<float, 4>{1, 1, 1, 1}));
    EXPECT_EQ(mesh.colors[1], (std::array<float, 4>{1, scene::linear_of_srgb(0.5F), 0, 1}));
    EXPECT_EQ(mesh.colors[2], (std::array<float, 4>{0, 0, 0, 0.5F}));
    EXPECT_ERROR(read_obj(as_bytes("v 0 0 0 255 0 0\n")), Code::kFormat,
                 "OBJ line 1: a colour behind the coordinates is 255, expected 0 to 1");
}

TEST(ObjVertices, NormalsOfCorners) {
    const std::string four = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    const auto loaded =
        need(read_obj(as_bytes(four + "vn 0 0 1\nvn nan 0 0\nf 1//1 2//-1 3\nf 1//2 2//2 4//2\n")));
    const TriangleMesh& mesh = loaded.mesh;
    EXPECT_EQ(mesh.normal_indices, (std::vector<scene::Triangle>{{0, 1, kNone}, {1, 1, 1}}));
    EXPECT_EQ(mesh.normals[1], (std::array<float, 3>{0, 0, 0}));
    EXPECT_TRUE(loaded.ignored.contains("1 normals that are not finite"));
    // Where each vertex has its own normal, one list of indices is enough.
    const auto smooth = need(read_obj(
        as_bytes(four + "vn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//3 4//4\n")));
    EXPECT_TRUE(smooth.mesh.normal_indices.empty());
    EXPECT_EQ(smooth.mesh.normals.size(), 4U);
    for (const auto& [text, sentence] :
         {std::pair("f 1//1 2 3\n", "names normal 1, but the file has 0"),
          std::pair("vt 0 0\nf 1/2 2/1 3/1\n", "names texture coordinate 2, but the file has 1"),
          std::pair("vt 0 0\nf 1/1/1/1 2 3\n", "names normal 1,"),
          std::pair("vn 0 0 1\nf 1//1/1 2 3\n", "a corner is '1//1/1', expected at most v/t/n"),
          std::pair("vn 0 0\n", "there is no number of a normal")})
        EXPECT_ERROR(read_obj(as_bytes(four + text)), Code::kFormat, sentence) << text;
}

TEST(ObjVertices, TrianglesAreCountedBeforeMemoryIsTaken) {
    MeshOptions options;
    options.max_triangles = 2;
    const std::string three = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    EXPECT_OK(read_obj(as_bytes(three + "f 1 2 3 1\n"), options));
    EXPECT_ERROR(read_obj(as_bytes(three + "f 1 2 3 1\nf 1 2 3\n"), options), Code::kUnsupported,
                 "OBJ: 3 triangles, expected at most 2");
    options.limits.times_file = 1;
    options.limits.besides = 0;
    EXPECT_ERROR(read_obj(as_bytes(three + "f 1 2 3\n"), options), Code::kFormat, "OBJ: vertices");
}

}  // namespace
}  // namespace splat::io
