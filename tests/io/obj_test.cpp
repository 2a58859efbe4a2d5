#include <gtest/gtest.h>

#include "io/mesh/mesh.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Triangles = std::vector<Triangle>;

Result<scene::TriangleMesh> read(const std::string& text) {
    auto loaded = io::read_obj(io::as_bytes(text));
    if (!loaded.ok()) return loaded.status();
    return std::move(loaded.value().mesh);
}

constexpr const char* kFour = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, FacesOfEveryForm) {
    const auto mesh = need(
        read("# a house\r\no house\nv 0 0 0\nv 1 0 .5\nv 1 1e0 0 0.5 0.5 0.5\n"
             "\tv -0.0 1 0 1\nvt 0 0\nvn 0 0 1\ng front\nusemtl red\ns 1\n"
             "f 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 4//1\n  f 1/1/1 3/1/1 4/1/1 \r\nl 1 2\np 1\n"));
    EXPECT_EQ(mesh.vertices.size(), 4U);
    EXPECT_EQ(mesh.vertices[1], (scene::Vec3{1, 0, 0.5}));
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 1, 2}, {0, 1, 3}, {0, 2, 3}}));
}

TEST(Obj, PolygonsBecomeFans) {
    const auto mesh = need(read(std::string(kFour) + "v 0 2 0\nf 1 2 3 4 5\n"));
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(Obj, NegativeIndicesCountFromTheLatestVertex) {
    const auto mesh = need(read("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf -1 -2 -4\n"));
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {3, 2, 0}}));
}

TEST(Obj, AVertexMayFollowItsFace) {
    EXPECT_EQ(need(read(std::string("f 1 2 4\n") + kFour)).triangles, (Triangles{{0, 1, 3}}));
}

TEST(Obj, PointsAloneAreAMeshWithoutTriangles) {
    EXPECT_TRUE(need(read(kFour)).triangles.empty());
    EXPECT_OK(read(""));
}

TEST(Obj, ErrorsNameTheLine) {
    const std::string four = kFour;
    const std::pair<std::string, const char*> formats[] = {
        {four + "f 1 2\n", "OBJ line 5: a face of 2 corners"},
        {four + "f\n", "OBJ line 5: a face of 0 corners"},
        {four + "\n# gap\nf 1 2 5\n", "OBJ line 7: the face names vertex 5, but the file has 4"},
        {four + "f 1 2 0\n", "OBJ line 5: a corner is '0'"},
        {four + "f 1 2 -5\n", "OBJ line 5: a corner is -5, but 4 vertices stand before it"},
        {four + "f 1 2 x\n", "OBJ line 5: a corner is 'x'"},
        {four + "f 1 2 3.5\n", "OBJ line 5: a corner is '3.5'"},
        {four + "f 1 2 /3\n", "OBJ line 5: a corner is '/3'"},
        {four + "f 1 2 4294967296\n", "OBJ line 5: the face names vertex 4294967296"},
        {four + "f 1 2 99999999999999999999\n", "OBJ line 5"},
        {"v 1 2\n", "OBJ line 1: there is no coordinate"},
        {"v 1 2 x\n", "OBJ line 1: coordinate is 'x'"},
        {"v 1 2 nan\n", "OBJ line 1: a coordinate is not finite"},
        {"v 1 2 1e999\n", "OBJ line 1"},
        {"ply\n", "OBJ line 1: the keyword is 'ply'"},
    };
    for (const auto& [text, sentence] : formats)
        EXPECT_ERROR(read(text), Code::kFormat, sentence) << text;
    EXPECT_ERROR(read(four + "curv 0 1 1 2\n"), Code::kUnsupported,
                 "OBJ line 5: 'curv' belongs to a free-form surface");
    EXPECT_ERROR(read(four + "f 1 2 \\\n3\n"), Code::kUnsupported, "OBJ line 5: the line goes on");
}

TEST(Obj, EveryPrefixIsReadOrRefused) {
    const std::string text = std::string(kFour) + "f 1 2 3 4\nvn 0 0 1\nf -1//1 -2//1 -3//1\n";
    for (std::size_t size = 0; size <= text.size(); ++size) {
        const auto mesh = read(text.substr(0, size));
        if (mesh.ok()) {
            for (const auto& triangle : mesh.value().triangles)
                for (const std::uint32_t index : triangle)
                    EXPECT_LT(index, mesh.value().vertices.size());
        } else {
            EXPECT_EQ(mesh.status().code(), Code::kFormat) << size;
        }
    }
}

}  // namespace
}  // namespace splat::test
