#include "scene/triangle_mesh.h"

#include <algorithm>
#include <limits>
#include <span>

#include "core/rng.h"

namespace splat::scene {
namespace {

/// `given`: indices of their own; empty if those of the vertices stand for them.
Status check_corners(const char* what, std::size_t count, std::span<const Triangle> given,
                     const TriangleMesh& mesh) {
    if (given.empty() && count != 0 && count != mesh.vertices.size())
        return invalid("the mesh has %zu %ss for %zu vertices", count, what, mesh.vertices.size());
    if (!given.empty() && given.size() != mesh.triangles.size())
        return invalid("the mesh has %zu triangles, but the %ss of %zu", mesh.triangles.size(),
                       what, given.size());
    for (std::size_t i = 0; i < given.size(); ++i)
        for (const std::uint32_t index : given[i])
            if (index >= count && index != kNone)
                return invalid("triangle %zu names %s %u, but the mesh has %zu", i, what, index,
                               count);
    return {};
}

Status check_materials(const TriangleMesh& mesh) {
    if (!mesh.material_of.empty() && mesh.material_of.size() != mesh.triangles.size())
        return invalid("the mesh has %zu triangles, but materials for %zu", mesh.triangles.size(),
                       mesh.material_of.size());
    for (std::size_t i = 0; i < mesh.material_of.size(); ++i)
        if (mesh.material_of[i] >= mesh.materials.size())
            return invalid("triangle %zu names material %u, but the mesh has %zu", i,
                           mesh.material_of[i], mesh.materials.size());
    for (std::size_t i = 0; i < mesh.materials.size(); ++i)
        if (mesh.materials[i].texture != kNone && mesh.materials[i].texture >= mesh.textures.size())
            return invalid("material %zu names texture %u, but the mesh has %zu", i,
                           mesh.materials[i].texture, mesh.textures.size());
    for (std::size_t i = 0; i < mesh.textures.size(); ++i) {
        const Texture& texture = mesh.textures[i];
        if (texture.texels.empty() ||
            texture.texels.size() != std::size_t{texture.width} * texture.height)
            return invalid("texture %zu has %zu texels, expected %u x %u, more than 0", i,
                           texture.texels.size(), texture.width, texture.height);
    }
    return {};
}

double unit_of(std::uint32_t word) {
    return static_cast<double>(word) * 0x1p-32;
}

double area_of(const TriangleMesh& mesh, const Triangle& triangle) {
    const Vec3& origin = mesh.vertices[triangle[0]];
    return glm::length(glm::cross(mesh.vertices[triangle[1]] - origin,
                                  mesh.vertices[triangle[2]] - origin)) /
           2;
}

/// a + u (b - a) + v (c - a)
Vec3 point_between(const Vec3& a, const Vec3& b, const Vec3& c, double u, double v) {
    return a + (u * (b - a) + v * (c - a));
}

constexpr const char* kNoFaces = "the mesh has no faces";

}  // namespace

Status check_mesh(const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) return invalid(kNoFaces);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!is_finite(mesh.vertices[i]))
            return invalid("vertex %zu has a coordinate that is not finite", i);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t index : mesh.triangles[i])
            if (index >= mesh.vertices.size())
                return invalid("triangle %zu names vertex %u, but the mesh has %zu", i, index,
                               mesh.vertices.size());
    if (!mesh.colors.empty() && mesh.colors.size() != mesh.vertices.size())
        return invalid("the mesh has %zu colours for %zu vertices", mesh.colors.size(),
                       mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.colors.size(); ++i)
        for (const float value : mesh.colors[i])
            if (!std::isfinite(value)) return invalid("the colour of vertex %zu is not finite", i);
    SPLAT_TRY(check_corners("normal", mesh.normals.size(), mesh.normal_indices, mesh));
    SPLAT_TRY(
        check_corners("texture coordinate", mesh.texcoords.size(), mesh.texcoord_indices, mesh));
    return check_materials(mesh);
}

MeshMeasures measure(const TriangleMesh& mesh) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    MeshMeasures measures;
    measures.low = Vec3(kFar);
    measures.high = Vec3(-kFar);
    std::vector<bool> used(mesh.vertices.size());
    for (const Triangle& triangle : mesh.triangles) {
        for (const std::uint32_t index : triangle) {
            used[index] = true;
            measures.low = glm::min(measures.low, mesh.vertices[index]);
            measures.high = glm::max(measures.high, mesh.vertices[index]);
        }
        const double area = area_of(mesh, triangle);
        measures.area += area;
        if (area == 0) ++measures.zero_area;
    }
    measures.unused = static_cast<std::uint64_t>(std::ranges::count(used, false));
    if (mesh.triangles.empty()) measures.low = measures.high = Vec3{};
    return measures;
}

Status normalise(TriangleMesh& mesh, MeshSize size) {
    if (mesh.triangles.empty()) return invalid(kNoFaces);
    if (size == MeshSize::kAsGiven) return {};
    const MeshMeasures box = measure(mesh);
    const Vec3 center = box.low + (box.high - box.low) / 2.0;
    const Vec3 sides = box.high - box.low;
    double length = std::max({sides.x, sides.y, sides.z});
    if (size == MeshSize::kUnitDiagonal) length = glm::length(sides);
    if (size == MeshSize::kUnitSphere) {
        length = 0;
        for (const Triangle& triangle : mesh.triangles)
            for (const std::uint32_t index : triangle)
                length = std::max(length, glm::length(mesh.vertices[index] - center));
    }
    if (!(length > 0) || !std::isfinite(length))
        return invalid("the mesh has a size of %g, expected a finite one above 0", length);
    for (Vec3& vertex : mesh.vertices) {
        vertex = (vertex - center) / length;
        if (!is_finite(vertex)) vertex = {};  // one that no triangle names, far away
    }
    return {};
}

Result<std::vector<Vec3>> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                         std::uint64_t seed) {
    std::vector<double> sums;  // areas of all triangles up to each one
    sums.reserve(mesh.triangles.size());
    double sum = 0;
    for (const Triangle& triangle : mesh.triangles) sums.push_back(sum += area_of(mesh, triangle));
    if (sums.empty()) return invalid(kNoFaces);
    if (!(sums.back() > 0) || !std::isfinite(sums.back()))
        return invalid("the mesh has an area of %g, expected more than 0", sums.back());
    std::vector<Vec3> points;
    points.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::array<std::uint32_t, 4> words =
            philox({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32U), 0, 0},
                   {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U)});
        // 53 bits choose the triangle: large meshes have more than 2^32 times their least one.
        const double place =
            (unit_of(words[0]) + unit_of(words[1] & 0xFFFFF800U) * 0x1p-32) * sums.back();
        const auto at = std::upper_bound(sums.begin(), sums.end() - 1, place) - sums.begin();
        const auto& [a, b, c] = mesh.triangles[static_cast<std::size_t>(at)];
        double u = unit_of(words[2]), v = unit_of(words[3]);
        if (u + v > 1) {  // the other half of the parallelogram
            u = 1 - u;
            v = 1 - v;
        }
        points.push_back(point_between(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], u, v));
    }
    return points;
}

}  // namespace splat::scene
