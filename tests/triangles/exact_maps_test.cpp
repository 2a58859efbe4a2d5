// Depth, normals and coverage against ray casting in float64.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "triangles/mesh_cases.h"

namespace splat::test {
namespace {

using scene::TriangleMesh;
using scene::Vec3;
using triangles::Images;

/// Pixels nearer to an edge than this, or with a second triangle so close behind, depend on rounding.
constexpr double kEdge = 0.01;
constexpr double kClose = 1e-5;
constexpr double kGrazing = 0.17;  // cosine of 80 degrees

double near_of(const TriangleMesh& mesh) {
    const scene::MeshMeasures box = scene::measure(mesh);
    return 1e-3 * glm::length(box.high - box.low);
}

/// Compares maps of one view at every pixel. Returns how many pixels see the mesh and were compared.
std::size_t expect_exact_maps(const TriangleMesh& mesh, const scene::Camera& camera,
                              const Images& images, double near_plane) {
    const std::vector<ref::RefTriangle> triangles = ref_triangles(mesh);
    const ref::TriangleCamera seen_by = ref_camera(camera);
    const scene::MeshMeasures box = scene::measure(mesh);
    const double rounding = glm::length(box.high - box.low) * 0x1p-22;  // renderer.h
    std::size_t compared = 0;
    for (std::uint32_t y = 0; y < camera.height; ++y)
        for (std::uint32_t x = 0; x < camera.width; ++x) {
            const ref::RefSample truth =
                ref::cast(triangles, seen_by, x + 0.5, y + 0.5, near_plane);
            const std::size_t i = std::size_t{y} * camera.width + x;
            const auto depth = static_cast<double>(images.depth[i]);
            if (truth.edge < kEdge) continue;
            if (!truth.hit) {
                EXPECT_EQ(depth, 0) << "at " << x << ", " << y;
                EXPECT_EQ(images.normal[3 * i], 0.0F);
                continue;
            }
            if (std::abs(truth.hit->z - near_plane) < kClose * near_plane) continue;
            if (truth.behind < truth.hit->z * (1 + kClose)) continue;
            if (truth.hit->cosine < kGrazing) {
                EXPECT_NEAR(depth, truth.hit->z, 1e-3 * truth.hit->z) << "at " << x << ", " << y;
                continue;
            }
            ++compared;
            EXPECT_NEAR(depth, truth.hit->z, std::max(1e-5 * truth.hit->z, rounding))
                << "at " << x << ", " << y;
            const ref::Vec normal = seen_by.turned(truth.hit->normal);
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(static_cast<double>(images.normal[3 * i + k]), normal[k], 1e-5)
                    << "axis " << k << " at " << x << ", " << y;
        }
    return compared;
}

void expect_exact(const TriangleMesh& mesh, const std::vector<scene::Camera>& cameras,
                  std::size_t at_least, double near_plane = 0) {
    for (const vk::Kernels kernels : kernels_to_test()) {
        triangles::RenderDesc desc;
        desc.near_plane = near_plane;
        for (const scene::Camera& camera : cameras) {
            const Images images = drawn(*shared_context(kernels), mesh, {camera}, desc, kMaps);
            EXPECT_GE(expect_exact_maps(mesh, camera, images,
                                        near_plane > 0 ? near_plane : near_of(mesh)),
                      at_least);
            if (testing::Test::HasFailure()) return;
        }
    }
}

TEST(ExactMaps, OfRandomTriangles) {
    const TriangleMesh mesh = triangle_soup(300, 0.4, 1);
    expect_exact(mesh,
                 {camera_at({2, 1.5, 1}, 61, 45, 60), camera_at({-3, 0.2, -2}, 40, 64, 70),
                  camera_at({0, 0, 40}, 33, 17, 500)},
                 150);
}

TEST(ExactMaps, FromWithin) {
    expect_exact(triangle_soup(200, 0.6, 2),
                 {camera_at({0.3, 0.1, 0.2}, 48, 48, 30), camera_at({0.01, -0.3, 0}, 31, 64, 20)},
                 300);
}

TEST(ExactMaps, NearPlaneCutsTriangles) {
    TriangleMesh mesh = square_mesh();
    for (Vec3& vertex : mesh.vertices) vertex *= 50.0;
    // A metre above a plane that goes on behind the camera.
    expect_exact(mesh, {camera_at({3, 0.5, 1}, 64, 48, 40)}, 500);
    expect_exact(mesh, {camera_at({3, 0.5, 1}, 64, 48, 40)}, 200, 3.5);
    expect_exact(triangle_soup(60, 1, 3), {camera_at({1.2, 0.4, 0.3}, 64, 64, 40)}, 300, 1.1);
}

TEST(ExactMaps, InterpolateTheNormalsOfTheFile) {
    TriangleMesh mesh = sphere_mesh(12);
    for (const Vec3& vertex : mesh.vertices)
        mesh.normals.push_back({static_cast<float>(3 * vertex.x), static_cast<float>(3 * vertex.y),
                                static_cast<float>(3 * vertex.z)});
    expect_exact(mesh, {camera_at({2, 1, 0.7}, 64, 64, 60)}, 400);
    for (std::array<float, 3>& normal : mesh.normals)  // files that have them the wrong way round
        for (float& value : normal) value = -value;
    mesh.normal_indices = mesh.triangles;
    expect_exact(mesh, {camera_at({0.2, 0.1, 0.3}, 40, 40, 20)}, 400);
}

TEST(ExactMaps, OfSmallTriangles) {
    expect_exact(sphere_mesh(60), {camera_at({1.4, 1, 0.9}, 24, 24, 25)}, 200);
}

TEST(ExactMaps, SidesOfMaterials) {
    TriangleMesh mesh = sphere_mesh(10);
    mesh.materials.resize(1);
    mesh.materials[0].double_sided = false;
    expect_exact(mesh, {camera_at({2, 1, 0.7}, 48, 48, 60)}, 300);
    // Only back sides are seen from within.
    const Images within =
        drawn(*shared_context(), mesh, {camera_at({0.2, 0.1, 0.3}, 20, 20, 20)}, {}, kMaps);
    EXPECT_EQ(within.depth, std::vector<float>(400));
}

TEST(ExactMaps, DoNotDependOnThePlaceOrTheSize) {
    const TriangleMesh mesh = triangle_soup(200, 0.4, 4);
    for (const auto& [scale, offset] :
         {std::pair{1.0, 1e6}, std::pair{1e-12, 0.0}, std::pair{1e15, 3e15}}) {
        TriangleMesh moved = mesh;
        for (Vec3& vertex : moved.vertices) vertex = vertex * scale + Vec3(offset, -offset, offset);
        scene::Camera camera = camera_at({2, 1.5, 1}, 40, 30, 40);
        const scene::Mat3 rotation = scene::rotation_of(camera.world_to_camera);
        camera.world_to_camera =
            scene::make_pose(rotation, scene::translation_of(camera.world_to_camera) * scale -
                                           rotation * Vec3(offset, -offset, offset));
        const Images images = drawn(*shared_context(), moved, {camera}, {}, kMaps);
        EXPECT_GE(expect_exact_maps(moved, camera, images, near_of(moved)), 100U) << scale;
    }
}

/// Shares of a pixel's samples by ray casting, and how many of them depend on rounding.
struct Coverage {
    double share = 0, unsure = 0;
};

Coverage coverage_of(const std::vector<ref::RefTriangle>& mesh, const ref::TriangleCamera& camera,
                     std::uint32_t x, std::uint32_t y, std::uint32_t side, double near_plane) {
    Coverage coverage;
    for (std::uint32_t j = 0; j < side; ++j)
        for (std::uint32_t i = 0; i < side; ++i) {
            const ref::RefSample sample =
                ref::cast(mesh, camera, x + (i + 0.5) / side, y + (j + 0.5) / side, near_plane);
            const double part = 1.0 / (side * side);
            if (sample.hit) coverage.share += part;
            if (sample.edge < kEdge) coverage.unsure += part;
        }
    return coverage;
}

TEST(Coverage, IsThatOf64SamplesAPixel) {
    const TriangleMesh mesh = triangle_soup(40, 0.5, 5);
    const scene::Camera camera = camera_at({2, 1.5, 1}, 32, 24, 30);
    const std::vector<ref::RefTriangle> truth = ref_triangles(mesh);
    for (const std::uint32_t side : {1U, 2U, 4U, 8U}) {
        triangles::RenderDesc desc;
        desc.samples = side;
        const Images images = drawn(*shared_context(), mesh, {camera}, desc, kAll);
        double squared = 0;
        for (std::uint32_t i = 0; i < 32 * 24; ++i) {
            const auto share = static_cast<double>(images.alpha[i]);
            const Coverage exact =
                coverage_of(truth, ref_camera(camera), i % 32, i / 32, side, near_of(mesh));
            EXPECT_NEAR(share, exact.share, exact.unsure + 1e-6) << side << " at " << i;
            const double finest =
                coverage_of(truth, ref_camera(camera), i % 32, i / 32, 8, near_of(mesh)).share;
            squared += (share - finest) * (share - finest);
            // An edge through a pixel leaves out or adds at most a line of samples, a corner two.
            EXPECT_NEAR(share, finest, 2.5 / side) << side << " at " << i;
        }
        EXPECT_LT(std::sqrt(squared / (32 * 24)), 0.5 / side / std::sqrt(side)) << side;
    }
}

}  // namespace
}  // namespace splat::test
