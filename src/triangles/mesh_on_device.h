#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "scene/triangle_mesh.h"
#include "vk/context.h"

namespace splat::triangles {

/// A mesh in the memory of a device. Vertices are whole numbers there: `unit` of them, up to 2^30, from the centre of
/// the box, so that a mesh far from the origin keeps its shape.
struct MeshOnDevice {
    vk::Buffer vertices;          ///< int4 each: x, y, z, 0
    vk::Buffer corners;           ///< uint4 of each triangle: vertices, material
    vk::Buffer normal_indices;    ///< [T,3]; empty: those of the vertices
    vk::Buffer texcoord_indices;  ///< the same
    vk::Buffer attributes;  ///< words: normals [N,3], texture coordinates [N,2], colours [V,2]
    vk::Buffer texels;      ///< pack_materials()
    std::uint32_t triangles = 0;
    std::uint32_t bits = 0;  ///< what it has, see params/triangles/triangle_params.h
    std::uint32_t texcoords_at = 0, colors_at = 0, textures_at = 0;  ///< words before them
    bool transparent = false;  ///< some material is not opaque
    scene::Vec3 low{}, high{};
    double unit = 1;   ///< a power of two
    std::string note;  ///< what was left out so that the textures fit, as a sentence; "": nothing

    [[nodiscard]] scene::Vec3 center() const { return low + (high - low) / 2.0; }
};

/// Errors: those of scene::check_mesh() and Memory::allocate(); kInvalidArgument for a box beyond 10^30;
/// kUnsupported for a mesh with an array that the device does not bind.
Result<MeshOnDevice> upload(vk::Context& context, const scene::TriangleMesh& mesh);

/// Bounds of texture coordinates and of the factors that place textures: products stay finite, and float32 has eighths
/// of a texture there.
inline constexpr float kMostTexcoord = 1 << 20;
inline float texture_number(float given) {
    return std::isnan(given) ? 0.0F : std::clamp(given, -kMostTexcoord, kMostTexcoord);
}

/// Linear values of bytes, materials, textures with their levels, and texels, as shaders/include/triangles/surface.glsl
/// reads them. A level has half the side of the one before, each texel the mean of what it covers, in linear light.
struct PackedMaterials {
    std::vector<std::uint32_t> words;
    std::uint32_t textures_at = 0;
    std::uint32_t halved =
        0;  ///< textures that lost levels so that the words fit, the largest first
};

/// Errors: kUnsupported if the smallest levels do not fit, either.
Result<PackedMaterials> pack_materials(const scene::TriangleMesh& mesh, std::uint64_t most_words);

}  // namespace splat::triangles
