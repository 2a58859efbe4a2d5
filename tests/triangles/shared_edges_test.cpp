// Neighbours leave no hole, and no sample belongs to two.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "triangles/mesh_cases.h"

namespace splat::test {
namespace {

using scene::TriangleMesh;
using scene::Vec3;
using triangles::Images;

std::vector<scene::Triangle> every_other(const TriangleMesh& mesh, std::size_t first) {
    std::vector<scene::Triangle> kept;
    for (std::size_t i = first; i < mesh.triangles.size(); i += 2)
        kept.push_back(mesh.triangles[i]);
    return kept;
}

/// The samples of the even triangles and those of the odd ones are together those of all, each once. The surface has no
/// two layers.
void expect_each_sample_once(const TriangleMesh& mesh, const scene::Camera& camera) {
    const std::vector<scene::Triangle> parts[] = {every_other(mesh, 0), every_other(mesh, 1)};
    for (const std::uint32_t side : {1U, 4U, 8U}) {
        triangles::RenderDesc desc;
        desc.samples = side;
        desc.near_plane = 1e-3;
        const Images all = drawn(*shared_context(), mesh, {camera}, desc, kAll);
        TriangleMesh half = mesh;
        half.triangles = parts[0];
        const Images even = drawn(*shared_context(), half, {camera}, desc, kAll);
        half.triangles = parts[1];
        const Images odd = drawn(*shared_context(), half, {camera}, desc, kAll);
        for (std::size_t i = 0; i < all.alpha.size(); ++i) {
            EXPECT_EQ(even.alpha[i] + odd.alpha[i], all.alpha[i]) << "pixel " << i;
            EXPECT_FALSE(even.depth[i] > 0 && odd.depth[i] > 0) << "pixel " << i;
            EXPECT_EQ(even.depth[i] > 0 || odd.depth[i] > 0, all.depth[i] > 0) << "pixel " << i;
        }
    }
}

/// A plane of n x n squares of two triangles, whose corners lie where `place` puts them.
template <class Place>
TriangleMesh grid_mesh(std::uint32_t n, Place&& place) {
    TriangleMesh mesh;
    for (std::uint32_t y = 0; y <= n; ++y)
        for (std::uint32_t x = 0; x <= n; ++x) mesh.vertices.push_back(place(x, y));
    for (std::uint32_t y = 0; y < n; ++y)
        for (std::uint32_t x = 0; x < n; ++x) {
            const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({d, c, a});
        }
    return mesh;
}

/// A camera at the origin that looks along z, 32 x 32 pixels; x / z = 1 is 16 pixels from the middle.
scene::Camera plain_camera() {
    return {"", 32, 32, 16, 16, 16, 16, scene::kNoPose};
}

TEST(SharedEdges, OnCentresOfPixels) {
    // Corners lie exactly on centres of pixels, so edges go through samples in eight directions.
    const TriangleMesh mesh = grid_mesh(8, [](std::uint32_t x, std::uint32_t y) {
        return Vec3((4.0 * x - 16 + 0.5) / 16, (4.0 * y - 16 + 0.5) / 16, 1);
    });
    expect_each_sample_once(mesh, plain_camera());
    const Images images = drawn(*shared_context(), mesh, {plain_camera()}, {}, kMaps);
    // From the upper left corner, on an edge, to the lower right one: 32 columns and rows, of which the rule keeps all.
    EXPECT_EQ(std::ranges::count(images.depth, 0.0F), 0);
}

TEST(SharedEdges, OfTiltedAndRandomPlanes) {
    Rng rng(3);
    const TriangleMesh mesh = grid_mesh(40, [&](std::uint32_t x, std::uint32_t y) {
        const double u = x / 10.0 - 2 + 0.04 * rng.uniform();
        const double v = y / 10.0 - 2 + 0.04 * rng.uniform();
        return Vec3(u, v, 1.5 + 0.1 * u - 0.1 * v);
    });
    expect_each_sample_once(mesh, plain_camera());
    EXPECT_EQ(
        std::ranges::count(drawn(*shared_context(), mesh, {plain_camera()}, {}, kMaps).depth, 0.0F),
        0);
}

TEST(SharedEdges, OfPlanesThroughTheNearPlane) {
    // A floor that reaches behind the camera.
    const TriangleMesh mesh = grid_mesh(
        30, [](std::uint32_t x, std::uint32_t y) { return Vec3(2.0 * x - 31, 0.5, 3.0 * y - 40); });
    expect_each_sample_once(mesh, plain_camera());
}

TEST(SharedEdges, OfSliversAndTinyTriangles) {
    const TriangleMesh slivers = grid_mesh(200, [](std::uint32_t x, std::uint32_t y) {
        return Vec3(x / 50.0 - 2, std::pow(y / 200.0, 6) * 4 - 2, 1.9);
    });
    expect_each_sample_once(slivers, plain_camera());
}

TEST(SharedEdges, OfSlopesNearTheCamera) {
    Rng rng(5);
    const TriangleMesh mesh = grid_mesh(60, [&](std::uint32_t x, std::uint32_t y) {
        const double u = x / 15.0 - 2, v = y / 15.0 - 2;
        return Vec3(u, v, 0.02 + 0.01 * (u + v + 4) + 1e-3 * rng.uniform());
    });
    expect_each_sample_once(mesh, plain_camera());
}

TEST(SharedEdges, ASphereHasNoHoleFromWithin) {
    for (const vk::Kernels kernels : kernels_to_test())
        for (const bool own_vertices : {false, true}) {
            const TriangleMesh mesh = sphere_mesh(160, own_vertices);  // 101,760 triangles
            EXPECT_GT(mesh.triangles.size(), 100000U);
            std::vector<scene::Camera> cameras;
            for (const Vec3& eye : {Vec3(0.1, 0.2, 0.3), Vec3(0, 0, 0.5), Vec3(-0.5, 0, 0)})
                cameras.push_back(camera_at(eye, 65, 65, 30));
            const Images images = drawn(*shared_context(kernels), mesh, cameras, {}, kAll);
            EXPECT_EQ(std::ranges::count(images.alpha, 1.0F), 3 * 65 * 65);
            EXPECT_EQ(std::ranges::count(images.depth, 0.0F), 0);
        }
}

TEST(SharedEdges, WithoutAreaNothingIsThere) {
    TriangleMesh mesh = square_mesh();
    mesh.texcoords.clear();
    mesh.vertices.push_back({0.5, 0, 0});
    mesh.triangles = {{0, 0, 0}, {0, 1, 1}, {0, 2, 0}, {4, 4, 2}, {3, 4, 4}};
    mesh.vertices.push_back({0, 0, 0});
    mesh.triangles.push_back({0, 5, 2});  // three corners on a line
    const Images images =
        drawn(*shared_context(), mesh, {camera_at({0.5, 0.4, 2}, 40, 40, 30)}, {}, kAll);
    EXPECT_EQ(images.alpha, std::vector<float>(1600));
    EXPECT_EQ(images.depth, std::vector<float>(1600));
    mesh.triangles = {{0, 1, 2}};  // seen from its own plane
    const Images flat =
        drawn(*shared_context(), mesh, {camera_at({5, 0.3, 0}, 40, 40, 30)}, {}, kAll);
    EXPECT_EQ(flat.alpha, std::vector<float>(1600));
}

}  // namespace
}  // namespace splat::test
