#include "triangles/mesh_cases.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/rng_fill.h"

namespace splat::test {

using scene::TriangleMesh;
using scene::Vec3;

TriangleMesh sphere_mesh(std::uint32_t n, bool own_vertices) {
    TriangleMesh mesh;
    const std::uint32_t columns = 2 * n;
    for (std::uint32_t row = 0; row <= n; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) {
            const double latitude = std::numbers::pi * row / n;
            const double longitude = 2 * std::numbers::pi * column / columns;
            const double ring = row == 0 || row == n ? 0 : std::sin(latitude);
            mesh.vertices.push_back(
                {ring * std::cos(longitude), ring * std::sin(longitude), std::cos(latitude)});
        }
    for (std::uint32_t row = 0; row < n; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t a = row * columns + column;
            const std::uint32_t b = row * columns + (column + 1) % columns;
            if (row + 1 < n) mesh.triangles.push_back({a, a + columns, b + columns});
            if (row > 0) mesh.triangles.push_back({a, b + columns, b});
        }
    if (!own_vertices) return mesh;
    const std::vector<Vec3> shared = std::move(mesh.vertices);
    mesh.vertices.clear();
    for (scene::Triangle& triangle : mesh.triangles)
        for (std::uint32_t& index : triangle) {
            mesh.vertices.push_back(shared[index]);
            index = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
        }
    return mesh;
}

TriangleMesh triangle_soup(std::size_t count, double size, std::uint64_t seed) {
    Rng rng(seed);
    const auto point = [&] {
        const double x = rng.uniform(), y = rng.uniform(), z = rng.uniform();
        return Vec3(x, y, z) * 2.0 - 1.0;
    };
    TriangleMesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        const Vec3 middle = point();
        for (std::size_t k = 0; k < 3; ++k)
            mesh.vertices.push_back(middle * (1 - size) + point() * size);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

TriangleMesh square_mesh() {
    TriangleMesh mesh;
    mesh.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    mesh.texcoords = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

scene::Camera camera_at(const Vec3& eye, std::uint32_t width, std::uint32_t height, double focal) {
    const Vec3 up = std::abs(eye.x) + std::abs(eye.y) > 0 ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
    return {"",    width,       height,       focal,
            focal, width / 2.0, height / 2.0, need(scene::look_at(eye, {0, 0, 0}, up))};
}

ref::TriangleCamera ref_camera(const scene::Camera& camera) {
    return {camera.fx, camera.fy, camera.cx, camera.cy, camera.world_to_camera};
}

std::vector<ref::RefTriangle> ref_triangles(const TriangleMesh& mesh) {
    std::vector<ref::RefTriangle> triangles;
    const auto wide = [](float value) { return static_cast<double>(value); };
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        ref::RefTriangle triangle;
        const std::uint32_t material = mesh.material_of.empty() ? 0 : mesh.material_of[i];
        if (!mesh.materials.empty()) triangle.double_sided = mesh.materials[material].double_sided;
        if (!mesh.normals.empty()) triangle.normals.emplace();
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = mesh.triangles[i][k];
            const Vec3& at = mesh.vertices[vertex];
            triangle.corners[k] = {at.x, at.y, at.z};
            triangle.colors[k] = {1, 1, 1, 1};
            if (!mesh.colors.empty())
                std::ranges::transform(mesh.colors[vertex], triangle.colors[k].begin(), wide);
            if (!mesh.texcoords.empty()) {
                const auto& list = mesh.texcoord_indices;
                std::ranges::transform(mesh.texcoords[list.empty() ? vertex : list[i][k]],
                                       triangle.texcoords[k].begin(), wide);
            }
            if (!triangle.normals) continue;
            const auto& list = mesh.normal_indices;
            ref::Vec normal{};
            std::ranges::transform(mesh.normals[list.empty() ? vertex : list[i][k]], normal.begin(),
                                   wide);
            (*triangle.normals)[k] =
                ref::scaled(normal, 1 / std::sqrt(ref::dot_of(normal, normal)));
        }
        triangles.push_back(triangle);
    }
    return triangles;
}

triangles::Images drawn(vk::Context& context, const TriangleMesh& mesh,
                        const std::vector<scene::Camera>& cameras,
                        const triangles::RenderDesc& desc, const triangles::Wanted& wanted) {
    const triangles::MeshOnDevice on_device = need(triangles::upload(context, mesh));
    return need(triangles::render(context, on_device, cameras, desc, wanted));
}

}  // namespace splat::test
