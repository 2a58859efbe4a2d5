#include "scene/triangle_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/expect_status.h"

namespace splat::test {
namespace {

using scene::MeshSize;
using scene::sample_surface;
using scene::TriangleMesh;
using scene::Vec3;

/// The unit square in the plane z = 2 as two triangles, and a triangle of 3 times its area at z = 5.
TriangleMesh two_planes() {
    return {{{0, 0, 2}, {1, 0, 2}, {1, 1, 2}, {0, 1, 2}, {0, 0, 5}, {2, 0, 5}, {0, 3, 5}},
            {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}};
}

TEST(SurfacePoints, LieOnTheSurfaceEvenly) {
    constexpr std::size_t kCount = 40000;
    const auto points = need(sample_surface(two_planes(), kCount, 7));
    ASSERT_EQ(points.size(), kCount);
    double square = 0, quarter = 0;
    for (const Vec3& point : points) {
        ASSERT_GE(point[0], 0);
        ASSERT_GE(point[1], 0);
        if (point[2] == 2) {
            square += 1;
            ASSERT_LE(std::max(point[0], point[1]), 1);
            if (point[0] < 0.5 && point[1] < 0.5) quarter += 1;
        } else {
            ASSERT_EQ(point[2], 5);
            ASSERT_LE(point[0] / 2 + point[1] / 3, 1 + 1e-12);
        }
    }
    // Four standard deviations of a binomial distribution.
    EXPECT_NEAR(square / kCount, 0.25, 4 * std::sqrt(0.25 * 0.75 / kCount));
    EXPECT_NEAR(quarter / square, 0.25, 4 * std::sqrt(0.25 * 0.75 / square));
}

TEST(SurfacePoints, TheSeedAndThePlaceDecide) {
    const auto a = need(sample_surface(two_planes(), 100, 7)),
               longer = need(sample_surface(two_planes(), 200, 7)),
               other = need(sample_surface(two_planes(), 100, 8));
    EXPECT_TRUE(std::equal(a.begin(), a.end(), longer.begin()));
    EXPECT_NE(a, other);
}

TEST(SurfacePoints, TrianglesWithoutAreaGetNone) {
    TriangleMesh mesh = two_planes();
    mesh.vertices.push_back({9, 9, 9});
    mesh.triangles = {{7, 7, 7}, {0, 1, 2}, {7, 7, 0}};
    const auto points = need(sample_surface(mesh, 1000, 1));
    for (const Vec3& point : points) EXPECT_EQ(point[2], 2);
    mesh.triangles = {{7, 7, 7}};
    EXPECT_ERROR(sample_surface(mesh, 1, 1), Code::kInvalidArgument, "an area of 0");
    EXPECT_ERROR(sample_surface({}, 1, 1), Code::kInvalidArgument, "no faces");
    mesh.vertices[7] = {1e300, 1e300, 0};
    mesh.triangles = {{0, 1, 7}, {1, 2, 7}};
    EXPECT_ERROR(sample_surface(mesh, 1, 1), Code::kInvalidArgument, "expected more than 0");
}

/// A box of sides 2, 1 and 4 around (c, c, c), and a vertex far away that no triangle names.
TriangleMesh box_at(double c) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.vertices.push_back({c + ((i & 1) != 0 ? 1.0 : -1.0), c + ((i & 2) != 0 ? 0.5 : -0.5),
                                 c + ((i & 4) != 0 ? 2.0 : -2.0)});
    mesh.vertices.push_back({1e9, 0, 0});
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

TEST(TriangleMesh, MeasuresCountWhatTrianglesName) {
    TriangleMesh mesh = box_at(0);
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({0, 3, 0});
    const scene::MeshMeasures measures = scene::measure(mesh);
    EXPECT_EQ(measures.low, (Vec3{-1, -0.5, -2}));
    EXPECT_EQ(measures.high, (Vec3{1, 0.5, 2}));
    EXPECT_DOUBLE_EQ(measures.area, 2 * (2 * 1 + 2 * 4 + 1 * 4));
    EXPECT_EQ(measures.zero_area, 2U);
    EXPECT_EQ(measures.unused, 1U);
}

TEST(TriangleMesh, SizesAreThoseOfTheirNames) {
    const std::pair<MeshSize, double> sizes[] = {{MeshSize::kUnitCube, 4},
                                                 {MeshSize::kUnitDiagonal, std::sqrt(21.0)},
                                                 {MeshSize::kUnitSphere, std::sqrt(21.0) / 2}};
    for (const auto& [size, length] : sizes) {
        TriangleMesh mesh = box_at(3);
        ASSERT_OK(scene::normalise(mesh, size));
        EXPECT_NEAR(mesh.vertices[7].z, 2 / length, 1e-15);
        EXPECT_NEAR(mesh.vertices[0].x, -1 / length, 1e-15);
    }
    TriangleMesh mesh = box_at(3);
    ASSERT_OK(scene::normalise(mesh, MeshSize::kAsGiven));
    EXPECT_EQ(mesh.vertices, box_at(3).vertices);
}

TEST(TriangleMesh, AMeshFarFromTheOriginKeepsItsShape) {
    TriangleMesh near = box_at(0), far = box_at(1e6);
    ASSERT_OK(scene::normalise(near, MeshSize::kUnitCube));
    ASSERT_OK(scene::normalise(far, MeshSize::kUnitCube));
    for (std::size_t i = 0; i < 8; ++i)
        EXPECT_LT(glm::length(near.vertices[i] - far.vertices[i]), 1e-10) << i;
    const auto points = need(sample_surface(far, 100, 1));
    for (const Vec3& point : points)
        EXPECT_LE(std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)}), 0.5 + 1e-10);
}

TEST(TriangleMesh, ASizeOfNothingIsRefused) {
    TriangleMesh mesh;
    EXPECT_ERROR(scene::normalise(mesh, MeshSize::kUnitCube), Code::kInvalidArgument, "no faces");
    mesh.vertices = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
    mesh.triangles = {{0, 1, 2}};
    EXPECT_ERROR(scene::normalise(mesh, MeshSize::kUnitCube), Code::kInvalidArgument, "size of 0");
    mesh.vertices = {{1e308, 0, 0}, {-1e308, 0, 0}, {0, 1, 0}};
    EXPECT_ERROR(scene::normalise(mesh, MeshSize::kUnitSphere), Code::kInvalidArgument, "size of");
    EXPECT_EQ(mesh.vertices[0].x, 1e308);
}

TEST(TriangleMesh, ChecksNameWhatIsWrong) {
    const auto refused = [](auto change, const char* sentence) {
        TriangleMesh mesh = box_at(0);
        mesh.materials.resize(1);
        ASSERT_OK(scene::check_mesh(mesh));
        change(mesh);
        EXPECT_ERROR(scene::check_mesh(mesh), Code::kInvalidArgument, sentence);
    };
    refused([](TriangleMesh& m) { m.triangles.clear(); }, "no faces");
    refused([](TriangleMesh& m) { m.vertices[3].y = std::numeric_limits<double>::quiet_NaN(); },
            "vertex 3 has a coordinate");
    refused([](TriangleMesh& m) { m.triangles[5][2] = 9; },
            "triangle 5 names vertex 9, but the mesh has 9");
    refused([](TriangleMesh& m) { m.colors.resize(3); }, "3 colours for 9 vertices");
    refused([](TriangleMesh& m) { m.normals.resize(3); }, "3 normals for 9 vertices");
    refused(
        [](TriangleMesh& m) {
            m.texcoords.resize(2);
            m.texcoord_indices.resize(m.triangles.size());
            m.texcoord_indices[1] = {0, 1, 2};
        },
        "triangle 1 names texture coordinate 2, but the mesh has 2");
    refused([](TriangleMesh& m) { m.material_of = {0}; }, "materials for 1");
    refused([](TriangleMesh& m) { m.material_of.resize(m.triangles.size(), 1); },
            "triangle 0 names material 1, but the mesh has 1");
    refused([](TriangleMesh& m) { m.materials[0].texture = 0; },
            "material 0 names texture 0, but the mesh has 0");
    refused([](TriangleMesh& m) { m.textures = {{2, 2, {}}}; }, "texture 0 has 0 texels");
}

}  // namespace
}  // namespace splat::test
