#include "triangles/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "triangles/mesh_cases.h"

namespace splat::test {
namespace {

using scene::TriangleMesh;
using scene::Vec3;
using triangles::Images;

bool same_bits(const Images& a, const Images& b) {
    return a.color == b.color && a.alpha == b.alpha && a.depth == b.depth && a.normal == b.normal &&
           a.albedo == b.albedo;
}

TEST(MeshRenderer, PartsGiveTheSameBits) {
    const TriangleMesh mesh = triangle_soup(700, 0.3, 11);
    const std::vector<scene::Camera> cameras = {camera_at({2, 1.5, 1}, 57, 43, 50),
                                                camera_at({0.2, 0.1, -0.3}, 57, 43, 20)};
    const Images whole = drawn(*shared_context(), mesh, cameras, {}, kAll);
    EXPECT_EQ(whole.views, 2U);
    EXPECT_GT(std::ranges::count_if(whole.depth, [](float depth) { return depth > 0; }), 2000);
    triangles::RenderDesc parts;
    parts.most_triangles = 97;
    EXPECT_TRUE(same_bits(whole, drawn(*shared_context(), mesh, cameras, parts, kAll)));
    parts.most_samples = 1;
    EXPECT_TRUE(same_bits(whole, drawn(*shared_context(), mesh, cameras, parts, kAll)));
    for (std::size_t view = 0; view < 2; ++view) {
        const Images one = drawn(*shared_context(), mesh, {cameras[view]}, {}, kAll);
        EXPECT_TRUE(
            std::equal(one.color.begin(), one.color.end(),
                       whole.color.begin() + static_cast<std::ptrdiff_t>(view * one.color.size())));
    }
}

TEST(MeshRenderer, TheOrderOfTrianglesDoesNotCount) {
    TriangleMesh mesh = triangle_soup(300, 0.4, 12);
    const std::vector<scene::Camera> cameras = {camera_at({2, 1.5, 1}, 40, 40, 50)};
    const Images before = drawn(*shared_context(), mesh, cameras, {}, kAll);
    std::ranges::reverse(mesh.triangles);
    EXPECT_TRUE(same_bits(before, drawn(*shared_context(), mesh, cameras, {}, kAll)));
}

TEST(MeshRenderer, GivesWhatIsWanted) {
    const TriangleMesh mesh = sphere_mesh(8);
    const std::vector<scene::Camera> cameras = {camera_at({2, 1.5, 1}, 20, 12, 20)};
    const Images all = drawn(*shared_context(), mesh, cameras, {}, kAll);
    const Images albedo = drawn(*shared_context(), mesh, cameras, {},
                                {.color = false, .alpha = false, .albedo = true});
    EXPECT_EQ(albedo.albedo, all.albedo);
    EXPECT_TRUE(albedo.color.empty() && albedo.alpha.empty() && albedo.depth.empty());
    const Images maps = drawn(*shared_context(), mesh, cameras, {}, kMaps);
    EXPECT_EQ(maps.depth, all.depth);
    EXPECT_EQ(maps.normal, all.normal);
    EXPECT_TRUE(maps.albedo.empty());
    const Images none = drawn(*shared_context(), mesh, cameras, {}, {false, false});
    EXPECT_TRUE(none.color.empty());
    EXPECT_EQ(drawn(*shared_context(), mesh, {}).views, 0U);
}

TEST(MeshRenderer, NothingInSightIsBackground) {
    const TriangleMesh mesh = square_mesh();
    scene::Camera camera = camera_at({0, 0, 2}, 16, 16, 16);
    camera.world_to_camera[11] = -9;  // behind
    const Images behind = drawn(*shared_context(), mesh, {camera}, {}, kAll);
    EXPECT_EQ(behind.color, std::vector<float>(768, 1.0F));
    EXPECT_EQ(behind.depth, std::vector<float>(256));
    camera = camera_at({0, 0, 2}, 16, 16, 16);
    camera.cx = 4000;  // beside
    EXPECT_EQ(drawn(*shared_context(), mesh, {camera}, {}, kAll).alpha, std::vector<float>(256));
}

TEST(MeshRenderer, LensesMayBeExtreme) {
    const TriangleMesh mesh = triangle_soup(100, 0.5, 13);
    scene::Camera camera = camera_at({2, 1.5, 1}, 24, 24, 20);
    for (const auto& [focal, principal] :
         {std::pair{1e9, 12.0}, std::pair{1e-6, 12.0}, std::pair{20.0, -1048576.0},
          std::pair{1e9, 1048576.0}}) {
        camera.fx = focal;
        camera.cx = principal;
        const Images images = drawn(*shared_context(), mesh, {camera}, {}, kAll);
        for (const float value : images.depth) EXPECT_TRUE(std::isfinite(value));
        for (const float value : images.color) EXPECT_TRUE(value >= 0 && value <= 1);
    }
}

TEST(MeshRenderer, TextureCoordinatesMayBeAnything) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    TriangleMesh mesh = square_mesh();
    mesh.textures = {{2, 1, {{255, 0, 0, 255}, {0, 255, 0, 99}}}};
    mesh.materials = {{.texture = 0,
                       .at = {3e38F, -3e38F, kInfinity, 3e38F, 1, 0},
                       .alpha = scene::AlphaMode::kMask}};
    mesh.texcoords = {{3e38F, -3e38F}, {kInfinity, 0}, {-kInfinity, NAN}, {1e20F, -1e-40F}};
    for (const bool nearest : {false, true}) {
        mesh.materials[0].nearest = nearest;
        const Images images =
            drawn(*shared_context(), mesh, {camera_at({0, 0.3, 2}, 16, 16, 16)}, {}, kAll);
        for (const float value : images.color) EXPECT_TRUE(value >= 0 && value <= 1);
    }
}

TEST(MeshRenderer, RefusesWhatIsWrong) {
    vk::Context* const context = shared_context();
    TriangleMesh mesh = square_mesh();
    const triangles::MeshOnDevice square = need(triangles::upload(*context, mesh));
    const std::vector<scene::Camera> cameras = {camera_at({0, 0, 2}, 16, 16, 16)};
    const auto refused = [&](auto change, const char* part) {
        triangles::RenderDesc desc;
        change(desc);
        EXPECT_ERROR(triangles::render(*context, square, cameras, desc, {}), Code::kInvalidArgument,
                     part);
    };
    refused([](auto& desc) { desc.samples = 3; }, "samples is 3, expected 1, 2, 4 or 8");
    refused([](auto& desc) { desc.background[1] = 1.5F; }, "1.5");
    refused([](auto& desc) { desc.up = {0, 0, 0}; }, "up");
    refused([](auto& desc) { desc.near_plane = -1; }, "near_plane");
    refused([](auto& desc) { desc.near_plane = std::numeric_limits<double>::quiet_NaN(); },
            "near_plane");
    std::vector<scene::Camera> two = {cameras[0], camera_at({0, 0, 2}, 16, 17, 16)};
    EXPECT_ERROR(triangles::render(*context, square, two, {}, {}), Code::kInvalidArgument, "17");
    two[1] = cameras[0];
    two[1].fx = 0;
    EXPECT_ERROR(triangles::render(*context, square, two, {}, {}), Code::kInvalidArgument,
                 "focal lengths are 0 and 16");
    mesh.vertices[2].x = 1e31;
    EXPECT_ERROR(triangles::upload(*context, mesh), Code::kInvalidArgument, "1e+31");
    mesh.triangles.clear();
    EXPECT_ERROR(triangles::upload(*context, mesh), Code::kInvalidArgument, "no faces");
}

TEST(MeshRenderer, TellsItsMemory) {
    const auto context = make_context();
    const TriangleMesh mesh = sphere_mesh(60);
    const std::uint64_t before = context->memory().use().live;
    const triangles::MeshOnDevice on_device = need(triangles::upload(*context, mesh));
    const std::uint64_t uploaded = context->memory().use().live - before;
    const std::uint64_t told = triangles::device_bytes(mesh, 128, 128, {});
    EXPECT_LE(uploaded, told);
    EXPECT_LE(told - uploaded, 128 * 128 * 17 * 8 + 128 * 128 * 48 + mesh.triangles.size() * 21);
    EXPECT_EQ(on_device.note, "");
}

}  // namespace
}  // namespace splat::test
