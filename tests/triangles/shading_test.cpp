// Base colours, textures, opacity and light against the same formulas in float64.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/srgb.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "triangles/mesh_cases.h"

namespace splat::test {
namespace {

using scene::TriangleMesh;
using scene::Vec3;
using triangles::Images;

double linear(float value) {
    return static_cast<double>(scene::linear_of_srgb(value));
}

scene::Texture random_texture(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
    Rng rng(seed);
    scene::Texture texture{width, height, {}};
    for (std::uint32_t i = 0; i < width * height; ++i) {
        std::array<std::uint8_t, 4> texel{};
        for (std::uint8_t& byte : texel) byte = static_cast<std::uint8_t>(rng.below(256));
        texture.texels.push_back(texel);
    }
    return texture;
}

ref::RefTexture ref_texture(const scene::Texture& texture, const scene::MeshMaterial& material) {
    ref::RefTexture made{
        static_cast<int>(texture.width),   static_cast<int>(texture.height),  {},
        static_cast<int>(material.wrap_u), static_cast<int>(material.wrap_v), material.nearest};
    for (const std::array<std::uint8_t, 4>& texel : texture.texels) {
        std::array<double, 4> value{};
        for (std::size_t k = 0; k < 3; ++k) value[k] = linear(static_cast<float>(texel[k]) / 255);
        value[3] = texel[3] / 255.0;
        made.texels.push_back(value);
    }
    return made;
}

/// The one texture of a mesh where a hit is, with the material's place of it.
std::array<double, 4> texture_of(const TriangleMesh& mesh, const ref::RefTexture& texture,
                                 const ref::RefTriangle& triangle, const ref::RefHit& hit) {
    double u = 0, v = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        u += hit.weights[k] * triangle.texcoords[k][0];
        v += hit.weights[k] * triangle.texcoords[k][1];
    }
    std::array<double, 6> at{};
    std::ranges::copy(mesh.materials[0].at, at.begin());
    return texture.at(at[0] * u + at[1] * v + at[2], at[3] * u + at[4] * v + at[5]);
}

/// A square with a magnified texture, one sample a pixel.
void expect_texture(TriangleMesh mesh, const scene::Camera& camera, vk::Kernels kernels) {
    const std::vector<ref::RefTriangle> truth = ref_triangles(mesh);
    const ref::RefTexture texture = ref_texture(mesh.textures[0], mesh.materials[0]);
    triangles::RenderDesc desc;
    desc.samples = 1;
    desc.light = false;
    const Images images = drawn(*shared_context(kernels), mesh, {camera}, desc, kAll);
    EXPECT_EQ(images.color, images.albedo);
    std::size_t compared = 0;
    for (std::uint32_t i = 0; i < camera.width * camera.height; ++i) {
        const ref::RefSample sample =
            ref::cast(truth, ref_camera(camera), i % camera.width + 0.5, i / camera.width + 0.5, 0);
        if (sample.edge < 0.01 || !sample.hit) continue;
        ++compared;
        const auto color = texture_of(mesh, texture, truth[sample.hit->triangle], *sample.hit);
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(linear(images.color[3 * i + k]), color[k], 2e-5)
                << "channel " << k << " at " << i;
    }
    EXPECT_GT(compared, 300U);
}

TEST(MeshShading, TexturesWrap) {
    TriangleMesh mesh = square_mesh();
    mesh.textures = {random_texture(5, 3, 1)};
    mesh.materials.resize(1);
    scene::MeshMaterial& material = mesh.materials[0];
    material.texture = 0;
    material.at = {2.6F, 0.3F, -0.7F, -0.4F, 3.1F, 0.55F};
    using scene::Wrap;
    for (const vk::Kernels kernels : kernels_to_test())
        for (const auto& [u, v] :
             {std::pair{Wrap::kRepeat, Wrap::kClamp}, std::pair{Wrap::kClamp, Wrap::kMirror},
              std::pair{Wrap::kMirror, Wrap::kRepeat}}) {
            material.wrap_u = u;
            material.wrap_v = v;
            expect_texture(mesh, camera_at({0.4, 0.3, 2.2}, 60, 50, 60), kernels);
        }
}

TEST(MeshShading, NearestTexelsAreNotMixed) {
    TriangleMesh mesh = square_mesh();
    mesh.textures = {random_texture(4, 4, 2)};
    mesh.materials = {{.texture = 0, .nearest = true}};
    triangles::RenderDesc desc;
    desc.light = false;
    const Images images =
        drawn(*shared_context(), mesh, {camera_at({0, 0, 2}, 40, 40, 40)}, desc, kAll);
    // Texels have 10 x 10 pixels. y of the picture points along v.
    for (std::uint32_t y = 0; y < 40; ++y)
        for (std::uint32_t x = 0; x < 40; ++x) {
            const auto& texel = mesh.textures[0].texels[y / 10 * 4 + x / 10];
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(images.albedo[3 * (y * 40 + x) + k], static_cast<float>(texel[k]) / 255,
                            1e-4F)
                    << x << ", " << y;
        }
}

TEST(MeshShading, SmallTexturesAreMeans) {
    TriangleMesh mesh = square_mesh();
    mesh.textures = {random_texture(301, 517, 3)};
    mesh.materials = {{.texture = 0}};
    std::array<double, 3> mean{};
    for (const auto& texel : mesh.textures[0].texels)
        for (std::size_t k = 0; k < 3; ++k)
            mean[k] += linear(static_cast<float>(texel[k]) / 255) / (301 * 517);
    triangles::RenderDesc desc;
    desc.light = false;
    const Images images =
        drawn(*shared_context(), mesh, {camera_at({0, 0, 2}, 8, 8, 8)}, desc, kAll);
    for (std::size_t k = 0; k < 3; ++k) {
        double sum = 0;
        for (std::size_t i = 0; i < 64; ++i) sum += linear(images.albedo[3 * i + k]) / 64;
        EXPECT_NEAR(sum, mean[k], 0.01);
        for (std::size_t i = 0; i < 64; ++i)
            EXPECT_NEAR(linear(images.albedo[3 * i + k]), mean[k], 0.06);
    }
}

TEST(MeshShading, LargeTexturesLoseLevels) {
    TriangleMesh mesh = square_mesh();
    mesh.textures = {random_texture(64, 32, 4), random_texture(8, 8, 5)};
    mesh.materials = {{.texture = 0}, {.texture = 1}};
    const triangles::PackedMaterials all = need(triangles::pack_materials(mesh, 1U << 20U));
    EXPECT_EQ(all.halved, 0U);
    const triangles::PackedMaterials few =
        need(triangles::pack_materials(mesh, all.words.size() - 64 * 32));
    EXPECT_EQ(few.halved, 1U);
    EXPECT_EQ(few.words.size(), all.words.size() - 64 * 32);
    // The records: where, width, height, levels. What is left is the same as before.
    const std::uint32_t* const record = &few.words[few.textures_at];
    EXPECT_EQ(record[1], 32U);
    EXPECT_EQ(record[2], 16U);
    EXPECT_EQ(record[3], 6U);
    EXPECT_TRUE(std::equal(few.words.begin() + record[0], few.words.end(),
                           all.words.begin() + all.words[all.textures_at] + 64 * 32));
    EXPECT_ERROR(triangles::pack_materials(mesh, 256 + 32 + 8 + 1), Code::kUnsupported,
                 "2 textures do not fit");
}

TEST(MeshShading, ColorsMultiply) {
    TriangleMesh mesh = square_mesh();
    mesh.textures = {{1, 1, {{128, 64, 255, 255}}}};
    mesh.colors.assign(4, {0.5F, 0.25F, 1, 1});
    mesh.materials = {{.color = {0.8F, 0.6F, 0.4F, 1}, .texture = 0}};
    triangles::RenderDesc desc;
    desc.light = false;
    const Images images =
        drawn(*shared_context(), mesh, {camera_at({0, 0, 2}, 4, 4, 4)}, desc, kAll);
    EXPECT_NEAR(linear(images.albedo[0]), 0.8 * 0.5 * linear(128.0F / 255), 1e-5);
    EXPECT_NEAR(linear(images.albedo[1]), 0.6 * 0.25 * linear(64.0F / 255), 1e-5);
    EXPECT_NEAR(linear(images.albedo[2]), 0.4, 1e-5);
    // Corners without texture coordinates see the material's colour.
    mesh.texcoord_indices = {{0, 1, scene::kNone}, {0, 2, scene::kNone}};
    const Images plain =
        drawn(*shared_context(), mesh, {camera_at({0, 0, 2}, 4, 4, 4)}, desc, kAll);
    EXPECT_NEAR(linear(plain.albedo[0]), 0.8 * 0.5, 1e-5);
}

TEST(MeshShading, MaskedPointsAreNotThere) {
    TriangleMesh mesh = square_mesh();
    mesh.textures = {{2, 1, {{255, 255, 255, 100}, {255, 255, 255, 200}}}};
    mesh.materials = {{.texture = 0,
                       .wrap_u = scene::Wrap::kClamp,
                       .nearest = true,
                       .alpha = scene::AlphaMode::kMask,
                       .alpha_cutoff = 0.5F}};
    for (const vk::Kernels kernels : kernels_to_test()) {
        const Images images =
            drawn(*shared_context(kernels), mesh, {camera_at({0, 0, 2}, 20, 20, 20)}, {}, kAll);
        for (std::uint32_t i = 0; i < 400; ++i) {
            EXPECT_EQ(images.alpha[i], i % 20 < 10 ? 0.0F : 1.0F) << i;
            EXPECT_EQ(images.depth[i] > 0, i % 20 >= 10) << i;
        }
    }
}

TEST(MeshShading, OpacityIsCoverage) {
    TriangleMesh mesh = square_mesh();
    mesh.materials = {{.color = {1, 1, 1, 0}, .alpha = scene::AlphaMode::kBlend}};
    for (const float opacity : {0.0F, 0.3F, 0.5F, 0.71F, 1.0F}) {
        mesh.materials[0].color[3] = opacity;
        const Images images =
            drawn(*shared_context(), mesh, {camera_at({0, 0, 2}, 9, 9, 9)}, {}, kAll);
        for (std::size_t i = 0; i < 81; ++i) {
            EXPECT_NEAR(images.alpha[i], opacity, 0.5F / 16 + 1e-6F);
            EXPECT_EQ(images.depth[i] > 0, opacity > 0.5F);
        }
    }
    // What is behind is seen through it.
    TriangleMesh both = square_mesh();
    for (const scene::Triangle& triangle : mesh.triangles) {
        both.triangles.push_back({triangle[0] + 4, triangle[1] + 4, triangle[2] + 4});
    }
    for (const Vec3& vertex : mesh.vertices) both.vertices.push_back(vertex + Vec3(0, 0, 0.5));
    both.texcoords.clear();
    both.material_of = {1, 1, 0, 0};
    both.materials = {{.color = {1, 0, 0, 0.25F}, .alpha = scene::AlphaMode::kBlend},
                      {.color = {0, 1, 0, 1}}};
    const Images images = drawn(*shared_context(), both, {camera_at({0, 0, 2}, 5, 5, 5)}, {}, kAll);
    EXPECT_EQ(images.alpha[12], 1.0F);
    EXPECT_NEAR(linear(images.albedo[36]), 0.25, 1e-5);
    EXPECT_NEAR(linear(images.albedo[37]), 0.75, 1e-5);
    EXPECT_NEAR(images.depth[12], 2.0F, 1e-5F);
}

TEST(MeshShading, LightIsAsDocumented) {
    const TriangleMesh mesh = sphere_mesh(24);
    const scene::Camera camera = camera_at({2, 1.2, 0.6}, 40, 40, 40);
    const std::vector<ref::RefTriangle> truth = ref_triangles(mesh);
    for (const Vec3& up : {Vec3(0, 0, 1), Vec3(0, 2, 0), Vec3(1, -1, 0.5)}) {
        triangles::RenderDesc desc;
        desc.samples = 1;
        desc.up = {up.x, up.y, up.z};
        const Images images = drawn(*shared_context(), mesh, {camera}, desc, kAll);
        const Vec3 sky = glm::normalize(up);
        // 45 degrees above the horizon: sin and cos are equal, and the light of two normals tells it.
        double brightest = 0, most = 0;
        for (std::uint32_t i = 0; i < 1600; ++i) {
            const ref::RefSample sample =
                ref::cast(truth, ref_camera(camera), i % 40 + 0.5, i / 40 + 0.5, 0);
            if (!sample.hit || sample.edge < 0.01) continue;
            const ref::Vec normal = sample.hit->normal;
            const double light = linear(images.color[3 * i]);
            const double base =
                0.35 + 0.25 * (0.5 + 0.5 * ref::dot_of(normal, {sky.x, sky.y, sky.z}));
            EXPECT_GE(light, base - 1e-5);
            EXPECT_LE(light, base + 0.4 + 1e-5);
            const double direct = (light - base) / 0.4;
            const double height = ref::dot_of(normal, {sky.x, sky.y, sky.z});
            EXPECT_LE(
                direct,
                std::cos(std::max(std::abs(std::asin(height) - 0.7853981634) - 1e-3, 0.0)) + 1e-5);
            if (direct > most) {
                most = direct;
                brightest = height;
            }
        }
        if (most > 0.99) {
            EXPECT_NEAR(brightest, std::sqrt(0.5), 0.12);
        }
    }
}

TEST(MeshShading, BackgroundIsMixedInLinearLight) {
    const TriangleMesh mesh = square_mesh();
    const scene::Camera camera = camera_at({1.3, 0.4, 2}, 24, 20, 18);
    triangles::RenderDesc desc;
    desc.background = {0, 0, 0};
    const Images black = drawn(*shared_context(), mesh, {camera}, desc, kAll);
    desc.background = {0.2F, 0.6F, 1};
    const Images other = drawn(*shared_context(), mesh, {camera}, desc, kAll);
    std::size_t partly = 0;
    for (std::size_t i = 0; i < black.alpha.size(); ++i) {
        if (black.alpha[i] > 0 && black.alpha[i] < 1) ++partly;
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(linear(other.color[3 * i + k]),
                        linear(black.color[3 * i + k]) +
                            (1 - static_cast<double>(black.alpha[i])) * linear(desc.background[k]),
                        1e-5);
    }
    EXPECT_GT(partly, 10U);
}

}  // namespace
}  // namespace splat::test
