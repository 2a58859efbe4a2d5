#pragma once

#include <cstdint>
#include <vector>

#include "ref/triangles_ref.h"
#include "scene/camera.h"
#include "scene/triangle_mesh.h"
#include "triangles/renderer.h"

namespace splat::test {

/// A sphere of radius 1 of 4 n^2 triangles or a few less, whose corners turn counterclockwise seen from outside. With
/// `own_vertices` no two triangles share a vertex in memory.
scene::TriangleMesh sphere_mesh(std::uint32_t n, bool own_vertices = false);

/// Random triangles of about this size within the cube from -1 to 1.
scene::TriangleMesh triangle_soup(std::size_t count, double size, std::uint64_t seed);

/// Two triangles: the square from -1 to 1 of the plane z = 0, facing +z; texture coordinates 0 to 1, v downwards.
scene::TriangleMesh square_mesh();

/// At `eye`, looking at the origin with z up; square pixels, a focal length of `focal` pixels.
scene::Camera camera_at(const scene::Vec3& eye, std::uint32_t width, std::uint32_t height,
                        double focal);

ref::TriangleCamera ref_camera(const scene::Camera& camera);
std::vector<ref::RefTriangle> ref_triangles(const scene::TriangleMesh& mesh);

/// A call of the renderer with a mesh that is uploaded for it. Fails the test if a call fails.
triangles::Images drawn(vk::Context& context, const scene::TriangleMesh& mesh,
                        const std::vector<scene::Camera>& cameras,
                        const triangles::RenderDesc& desc = {},
                        const triangles::Wanted& wanted = {});

inline constexpr triangles::Wanted kAll{.depth = true, .normal = true, .albedo = true};
inline constexpr triangles::Wanted kMaps{
    .color = false, .alpha = false, .depth = true, .normal = true};

}  // namespace splat::test
