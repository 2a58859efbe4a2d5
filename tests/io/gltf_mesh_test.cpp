#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "io/file.h"
#include "io/image.h"
#include "io/mesh/mesh.h"
#include "io/sample_files.h"
#include "io/scenes/sample_gltf.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using namespace test;
using scene::AlphaMode;
using scene::kNone;
using scene::MeshMaterial;
using scene::Triangle;
using scene::TriangleMesh;
using scene::Vec3;
using scene::Wrap;

using Triangles = std::vector<Triangle>;
using Color = std::array<float, 4>;

/// Four corners of a square in the plane z = 1, without indices.
SampleGltf square() {
    SampleGltf sample;
    sample.used = R"("extensionsUsed":[])";
    sample.primitive = R"("mode":4)";
    sample.add<float>("POSITION", {0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1}, kGltfFloat, "VEC3", 3);
    return sample;
}

template <class T>
SampleGltf indexed(const std::vector<T>& indices, int component, int mode = 4) {
    SampleGltf sample = square();
    const int index = sample.add<T>("", indices, component, "SCALAR", 1);
    sample.primitive =
        R"("mode":)" + std::to_string(mode) + R"(,"indices":)" + std::to_string(index);
    return sample;
}

SampleGltf two_triangles() {
    return indexed<std::uint16_t>({0, 1, 2, 0, 2, 3}, kGltfUshort);
}

Result<LoadedMesh> read(const SampleGltf& sample, const MeshOptions& options = {}) {
    return read_gltf_mesh(sample.glb(), options);
}

TriangleMesh mesh_of(const SampleGltf& sample) {
    auto loaded = need(read(sample));
    EXPECT_OK(scene::check_mesh(loaded.mesh));
    return std::move(loaded.mesh);
}

TEST(GltfMesh, IndicesOfEveryType) {
    const Triangles two = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(mesh_of(indexed<std::uint8_t>({0, 1, 2, 0, 2, 3}, kGltfUbyte)).triangles, two);
    EXPECT_EQ(mesh_of(two_triangles()).triangles, two);
    EXPECT_EQ(mesh_of(indexed<std::uint32_t>({0, 1, 2, 0, 2, 3}, kGltfUint)).triangles, two);
    const auto text = need(read_gltf_mesh(two_triangles().gltf()));
    EXPECT_EQ(text.mesh.triangles, two);
    EXPECT_EQ(text.mesh.vertices[2], (Vec3{1, 1, 1}));
}

TEST(GltfMesh, ListsStripsAndFans) {
    SampleGltf bare;
    bare.used = R"("extensionsUsed":[])";
    bare.primitive = R"("mode":4)";
    bare.add<float>("POSITION", {0, 0, 0, 1, 0, 0, 0, 1, 0}, kGltfFloat, "VEC3", 3);
    EXPECT_EQ(mesh_of(bare).triangles, (Triangles{{0, 1, 2}}));
    SampleGltf strip = square(), fan = square();
    strip.primitive = R"("mode":5)";
    fan.primitive = R"("mode":6)";
    EXPECT_EQ(mesh_of(strip).triangles, (Triangles{{0, 1, 2}, {1, 3, 2}}));
    EXPECT_EQ(mesh_of(fan).triangles, (Triangles{{1, 2, 0}, {2, 3, 0}}));
    EXPECT_EQ(mesh_of(indexed<std::uint8_t>({3, 2, 1, 0}, kGltfUbyte, 5)).triangles,
              (Triangles{{3, 2, 1}, {2, 0, 1}}));
}

TEST(GltfMesh, NodesPlaceMeshes) {
    SampleGltf sample = two_triangles();
    sample.add<float>("NORMAL", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, kGltfFloat, "VEC3", 3);
    // Once as it is, once stretched, once mirrored below a node that moves.
    sample.nodes = R"([{"mesh":0},{"mesh":0,"scale":[2,1,4],"translation":[0,0,1e6]},)"
                   R"({"children":[3],"translation":[5,0,0]},{"mesh":0,"scale":[1,1,-1]}])";
    sample.roots = "[0,1,2]";
    const TriangleMesh mesh = mesh_of(sample);
    ASSERT_EQ(mesh.vertices.size(), 12U);
    EXPECT_EQ(mesh.vertices[6], (Vec3{2, 1, 1e6 + 4}));
    EXPECT_EQ(mesh.vertices[10], (Vec3{6, 1, -1}));
    EXPECT_EQ(mesh.triangles,
              (Triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {8, 10, 9}, {8, 11, 10}}));
    EXPECT_EQ(mesh.normals[4], (std::array<float, 3>{0, 0, 1}));
    EXPECT_EQ(mesh.normals[8], (std::array<float, 3>{0, 0, -1}));
    EXPECT_TRUE(mesh.normal_indices.empty());
    sample.nodes = R"([{"mesh":0,"scale":[1,0,1]}])";
    sample.roots = "[0]";
    EXPECT_EQ(mesh_of(sample).vertices[2], (Vec3{1, 0, 1}));  // flat, without area
}

TEST(GltfMesh, NormalsTurnAsSurfacesDo) {
    SampleGltf sample = two_triangles();
    const float s = std::sqrt(0.5F);
    sample.add<float>("NORMAL", {s, 0, s, s, 0, s, s, 0, s, 0, 0, 0}, kGltfFloat, "VEC3", 3);
    sample.nodes = R"([{"mesh":0,"scale":[2,1,1]}])";
    const TriangleMesh mesh = mesh_of(sample);
    EXPECT_NEAR(mesh.normals[0][0], 1 / std::sqrt(5.0), 1e-6);
    EXPECT_NEAR(mesh.normals[0][2], 2 / std::sqrt(5.0), 1e-6);
    EXPECT_EQ(mesh.normals[3], (std::array<float, 3>{0, 0, 0}));
}

/// An image of one pixel in a buffer view, and what names it.
void add_texture(SampleGltf& sample, const std::string& info, const std::string& sampler = "") {
    const Buffer png = need(write_png({1, 1, 3, 8, {9, 8, 7}}));
    sample.add<std::byte>("", png, kGltfUbyte, "SCALAR", 1);
    const std::string view = std::to_string(sample.views.size() - 1);
    sample.more = R"(,"materials":[{"doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.25,)"
                  R"("pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0.25,0.5],)"
                  R"("baseColorTexture":{"index":0)" +
                  info + R"(}}},{}],"textures":[{"source":0)" +
                  (sampler.empty() ? "" : R"(,"sampler":0)") + R"(}],"images":[{"bufferView":)" +
                  view + R"(,"mimeType":"image/png"}])" +
                  (sampler.empty() ? "" : R"(,"samplers":[)" + sampler + "]");
}

TEST(GltfMesh, MaterialsAndTextures) {
    SampleGltf sample = two_triangles();
    sample.add<float>("TEXCOORD_0", {0, 0, 1, 0, 1, 1, 0, 1}, kGltfFloat, "VEC2", 2);
    sample.add<std::uint16_t>("TEXCOORD_1", {0, 0, 65535, 0, 65535, 65535, 0, 65535}, kGltfUshort,
                              "VEC2", 2, true);
    sample.primitive += R"(,"material":0)";
    sample.mesh = R"(,{"attributes":{"POSITION":0},"mode":6})";
    add_texture(sample,
                R"(,"texCoord":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],)"
                R"("rotation":1.5707963267948966,"scale":[2,3],"texCoord":1}})",
                R"({"wrapS":33071,"wrapT":33648,"magFilter":9728})");
    sample.used = R"("extensionsUsed":["KHR_texture_transform"],)"
                  R"("extensionsRequired":["KHR_texture_transform"])";
    const TriangleMesh mesh = mesh_of(sample);
    ASSERT_EQ(mesh.materials.size(), 2U);
    const MeshMaterial& m = mesh.materials[0];
    EXPECT_EQ(m.color, (Color{1, 0.5F, 0.25F, 0.5F}));
    EXPECT_TRUE(m.double_sided);
    EXPECT_EQ(m.alpha, AlphaMode::kMask);
    EXPECT_EQ(m.alpha_cutoff, 0.25F);
    EXPECT_EQ(m.wrap_u, Wrap::kClamp);
    EXPECT_EQ(m.wrap_v, Wrap::kMirror);
    EXPECT_TRUE(m.nearest);
    EXPECT_EQ(m.texture, 0U);
    const float expected[] = {0, 3, 0.5F, -2, 0, 0.25F};
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(m.at[i], expected[i], 1e-6) << i;
    EXPECT_EQ(mesh.textures[0].texels[0], (std::array<std::uint8_t, 4>{9, 8, 7, 255}));
    EXPECT_FALSE(mesh.materials[1].double_sided);
    EXPECT_EQ(mesh.material_of, (std::vector<std::uint32_t>{0, 0, 1, 1}));
    // The second primitive has the same vertices, but no texture coordinates.
    EXPECT_EQ(mesh.vertices.size(), 8U);
    EXPECT_EQ(mesh.texcoords[2], (std::array<float, 2>{1, 1}));
    EXPECT_EQ(mesh.texcoords[6], (std::array<float, 2>{0, 0}));
}

TEST(GltfMesh, DiffuseColoursOfOlderFiles) {
    SampleGltf sample = two_triangles();
    sample.primitive += R"(,"material":0)";
    sample.used = R"("extensionsUsed":["KHR_materials_pbrSpecularGlossiness"])";
    sample.more = R"(,"materials":[{"emissiveFactor":[1,1,1],"extensions":{)"
                  R"("KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0,1,1]}}}])";
    const LoadedMesh loaded = need(read(sample));
    EXPECT_EQ(loaded.mesh.materials[0].color, (Color{0.5F, 0, 1, 1}));
    EXPECT_TRUE(loaded.ignored.contains("material's emissiveFactor"));
}

TEST(GltfMesh, ColoursOfVertices) {
    SampleGltf sample = two_triangles();
    sample.add<std::uint16_t>("COLOR_0", {65535, 0, 0, 0, 65535, 0, 0, 0, 65535, 0, 0, 0},
                              kGltfUshort, "VEC3", 3, true);
    EXPECT_EQ(mesh_of(sample).colors,
              (std::vector<Color>{{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}, {0, 0, 0, 1}}));
    sample = two_triangles();
    sample.add<float>("COLOR_0", {1, 0, 0, 0.5F, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1}, kGltfFloat,
                      "VEC4", 4);
    EXPECT_EQ(mesh_of(sample).colors[0], (Color{1, 0, 0, 0.5F}));
    sample = two_triangles();
    sample.add<float>("COLOR_0", {1, 0, 0, 7, 1, 0, 0, 0, 1, 0, 0, 0}, kGltfFloat, "VEC3", 3);
    EXPECT_ERROR(read(sample), Code::kFormat,
                 "meshes[0].primitives[0]: colour 1 has 7, expected 0 to 1");
}

TEST(GltfMesh, QuantizedAndSparseNumbers) {
    SampleGltf sample;
    sample.primitive = R"("mode":6)";
    sample.used = R"("extensionsUsed":["KHR_mesh_quantization"],)"
                  R"("extensionsRequired":["KHR_mesh_quantization"])";
    sample.add<std::int16_t>("POSITION", {0, 0, 0, 0, 100, 0, 0, 0, 100, 100, 0, 0}, kGltfShort,
                             "VEC3", 4);
    sample.views[0].insert(sample.views[0].size() - 1, R"(,"byteStride":8)");
    const TriangleMesh mesh = mesh_of(sample);
    EXPECT_EQ(mesh.vertices[1], (Vec3{100, 0, 0}));
    sample.used = R"("extensionsUsed":[])";
    EXPECT_ERROR(read(sample), Code::kFormat, "numbers of type 'short', expected float");
    // Positions without bytes of their own, three of which are given.
    SampleGltf sparse;
    sparse.used = R"("extensionsUsed":[])";
    sparse.primitive = R"("mode":4)";
    sparse.add<std::uint8_t>("", {1, 2}, kGltfUbyte, "SCALAR", 1);
    sparse.add<float>("", {1, 0, 0, 0, 1, 0}, kGltfFloat, "VEC3", 3);
    sparse.accessors.push_back(
        R"({"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":2,)"
        R"("indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":1}}})");
    sparse.attributes["POSITION"] = 2;
    EXPECT_EQ(mesh_of(sparse).vertices, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST(GltfMesh, WhatIsWrongIsNamed) {
    const auto refused = [](const SampleGltf& sample, Code code, const char* sentence) {
        EXPECT_ERROR(read(sample), code, sentence);
    };
    refused(indexed<std::uint16_t>({0, 1, 2, 0, 4, 3}, kGltfUshort), Code::kFormat,
            "gltf: meshes[0].primitives[0]: triangle 1 names vertex 4, but there are 4");
    refused(indexed<std::uint32_t>({0, 1, UINT32_MAX}, kGltfUint), Code::kFormat,
            "triangle 0 names vertex 4294967295");
    refused(indexed<std::uint16_t>({0, 1, 2, 3}, kGltfUshort), Code::kFormat,
            "4 corners, expected 3 for each triangle");
    refused(indexed<std::uint16_t>({0, 1}, kGltfUshort, 5), Code::kFormat,
            "2 corners, expected 3 or more");
    refused(indexed<float>({0, 1, 2}, kGltfFloat), Code::kFormat, "of type 'float'");
    SampleGltf sample = two_triangles();
    sample.accessors[1].insert(sample.accessors[1].size() - 1, R"(,"normalized":true)");
    refused(sample, Code::kFormat, "'normalized unsigned short'");
    sample = two_triangles();
    sample.accessors[1].insert(sample.accessors[1].size() - 1,
                               R"(,"sparse":{"count":1,"indices":{"bufferView":1,)"
                               R"("componentType":5123},"values":{"bufferView":1}})");
    refused(sample, Code::kUnsupported, "sparse indices");
    for (const char* const name :
         {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        sample = two_triangles();
        sample.used = std::string(R"("extensionsUsed":[")") + name + "\"]";
        refused(sample, Code::kUnsupported, "which is not read; write it without compression");
    }
    sample = two_triangles();
    sample.used = R"("extensionsUsed":["EXT_mesh_gpu_instancing"])";
    refused(sample, Code::kUnsupported, "write a node for each instance");
    sample = two_triangles();
    sample.used = R"("extensionsRequired":["KHR_texture_basisu"])";
    refused(sample, Code::kUnsupported, "requires KHR_texture_basisu");
    sample = square();
    sample.primitive = R"("mode":1)";
    refused(sample, Code::kFormat, "no mesh of the scene has triangles");
    sample.primitive = R"("mode":7)";
    refused(sample, Code::kFormat, "mode 7, expected 0 to 6");
    sample = two_triangles();
    sample.primitive += R"(,"material":0)";
    refused(sample, Code::kFormat, "materials[0] is named, but there are 0");
    refused(test::sample_gltf(), Code::kFormat, "is it a scene of Gaussians");
}

TEST(GltfMesh, PositionsThatAreNotFinite) {
    SampleGltf sample = two_triangles();
    const float bad = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(sample.bytes.data() + 4 * 4, &bad, 4);
    EXPECT_ERROR(read(sample), Code::kFormat,
                 "gltf: meshes[0].primitives[0]: position 1 is not finite");
    sample = two_triangles();
    sample.nodes = R"([{"mesh":0,"scale":[1e308,1,1],"translation":[1.7e308,0,0]}])";
    EXPECT_ERROR(read(sample), Code::kFormat, "position 1 is not finite where its node has it");
    sample = two_triangles();
    sample.add<float>("NORMAL", {0, 0, bad, 0, 0, 1, 0, 0, 1, 0, 0, 1}, kGltfFloat, "VEC3", 3);
    EXPECT_TRUE(need(read(sample)).ignored.contains("1 normals that are not finite"));
}

TEST(GltfMesh, AllPlacesAreCountedBeforeMemoryIsTaken) {
    SampleGltf sample = two_triangles();
    sample.nodes = "[";
    sample.roots = "[";
    for (int i = 0; i < 1000; ++i) {
        sample.nodes += (i == 0 ? "" : ",") + std::string(R"({"mesh":0})");
        sample.roots += (i == 0 ? "" : ",") + std::to_string(i);
    }
    sample.nodes += "]";
    sample.roots += "]";
    EXPECT_EQ(mesh_of(sample).triangles.size(), 2000U);
    MeshOptions options;
    options.max_triangles = 1999;
    EXPECT_ERROR(read(sample, options), Code::kUnsupported,
                 "gltf: 2000 triangles of 4000 vertices");
    options.max_triangles = 2000;
    options.limits.times_file = 2;
    options.limits.besides = 0;
    EXPECT_ERROR(read(sample, options), Code::kFormat, "gltf: ");
    SampleGltf lies = square();
    lies.accessors[0] = R"({"componentType":5126,"count":3000000000000,"type":"VEC3"})";
    EXPECT_ERROR(read(lies), Code::kUnsupported, "triangles of 3000000000000 vertices");
    lies.accessors[0] = R"({"componentType":5126,"count":3000000,"type":"VEC3"})";
    EXPECT_ERROR(read(lies), Code::kFormat, "gltf: vertices");
}

TEST(GltfMesh, ImagesThatCannotBeRead) {
    SampleGltf sample = two_triangles();
    sample.add<float>("TEXCOORD_0", {0, 0, 1, 0, 1, 1, 0, 1}, kGltfFloat, "VEC2", 2);
    sample.primitive += R"(,"material":0)";
    add_texture(sample, "");
    EXPECT_EQ(mesh_of(sample).materials[0].texture, 0U);
    MeshOptions options;
    options.surface_only = true;
    const LoadedMesh bare = need(read(sample, options));
    EXPECT_TRUE(bare.mesh.materials.empty() && bare.mesh.texcoords.empty());
    options.surface_only = false;
    options.max_texels = 0;
    EXPECT_ERROR(read(sample, options), Code::kUnsupported, "gltf: images[0]: 1 x 1 texels");
    options.lenient = true;
    const LoadedMesh without = need(read(sample, options));
    EXPECT_EQ(without.mesh.materials[0].texture, kNone);
    EXPECT_FALSE(without.ignored.empty());
    const std::size_t at = sample.more.find(R"("bufferView":)");
    sample.more.replace(at, sample.more.find(',', at) - at, R"("uri":"no.png")");
    EXPECT_ERROR(read(sample), Code::kUnsupported, "is the file 'no.png'");
    sample = two_triangles();
    sample.primitive += R"(,"material":0)";
    add_texture(sample, "");
    EXPECT_ERROR(read(sample), Code::kFormat, "TEXCOORD_0 is missing");
}

class GltfMeshFiles : public FolderTest {};

TEST_F(GltfMeshFiles, BesideTheDocument) {
    SampleGltf sample = two_triangles();
    sample.buffer = R"(,"uri":"a.bin")";
    ASSERT_OK(write_file(path("a.bin"), sample.bytes));
    ASSERT_OK(write_file(path("a.gltf"), as_bytes(sample.json())));
    EXPECT_EQ(need(load_mesh(path("a.gltf"))).mesh.triangles.size(), 2U);
    ASSERT_OK(write_file(path("b.glb"), two_triangles().glb()));
    EXPECT_EQ(need(load_mesh(path("b.glb"))).mesh.triangles.size(), 2U);
    ASSERT_OK(write_file(path("a.bin"), as_bytes("x")));
    EXPECT_ERROR(load_mesh(path("a.gltf")), Code::kFormat, "a.gltf");
}

TEST(GltfMesh, EveryPrefixAndEveryDamagedByteIsReadOrRefused) {
    SampleGltf sample = two_triangles();
    sample.add<float>("TEXCOORD_0", {0, 0, 1, 0, 1, 1, 0, 1}, kGltfFloat, "VEC2", 2);
    sample.primitive += R"(,"material":0)";
    add_texture(sample, "");
    const Buffer file = sample.glb();
    const auto good = [](const Buffer& bytes) {
        const auto loaded = read_gltf_mesh(bytes);
        if (loaded.ok()) {
            EXPECT_OK(scene::check_mesh(loaded.value().mesh));
            return;
        }
        EXPECT_TRUE(loaded.status().code() == Code::kFormat ||
                    loaded.status().code() == Code::kUnsupported)
            << loaded.status().message();
    };
    for (std::size_t size = 0; size < file.size(); ++size)
        good({file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)});
    for (std::size_t i = 0; i < file.size(); ++i)
        for (const unsigned flip : {1U, 0x80U}) {
            Buffer damaged = file;
            damaged[i] ^= static_cast<std::byte>(flip);
            good(damaged);
        }
}

}  // namespace
}  // namespace splat::io
