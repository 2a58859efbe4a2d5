#include "triangles/mesh_on_device.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "params/triangles/triangle_params.h"

namespace splat::triangles {
namespace {

constexpr std::size_t kPiece =
    1U << 18U;  ///< elements packed at a time, to bound the host's memory
constexpr double kMostCoordinate = 1e30;
constexpr int kVertexBits = 30;

/// An empty buffer would have no range to bind.
Result<vk::Buffer> allocate(vk::Context& context, std::uint64_t bytes, const char* name) {
    return context.memory().allocate(std::max<std::uint64_t>(bytes, 16), vk::MemoryKind::kDevice,
                                     name);
}

/// Bytes that a kernel binds of an array whose elements have `element` bytes.
std::uint64_t most_bytes(vk::Context& context, std::uint64_t element) {
    const vk::DeviceLimits& limits = context.device().info().limits;
    const std::uint64_t most = context.device().kernels(vk::Family::kNetwork) == vk::Kernels::kCpu
                                   ? limits.max_texel_elements * element
                                   : limits.max_storage_buffer_bytes;
    return std::min(most, limits.max_allocation_bytes);
}

Status check_bytes(vk::Context& context, std::uint64_t bytes, std::uint64_t element,
                   const char* what) {
    const std::uint64_t most = most_bytes(context, element);
    if (bytes <= most) return {};
    return unsupported(
        "the mesh's %s take %llu bytes, this device binds %llu: simplify the mesh, or draw it on "
        "another device",
        what, llu(bytes), llu(most));
}

/// Write `count` elements of `words` words in pieces: `fill(i, to)` makes one.
template <class Fill>
Status write_elements(vk::Context& context, const vk::BufferView& to, std::size_t count,
                      std::size_t words, Fill&& fill) {
    std::vector<std::uint32_t> piece(std::min(kPiece, count) * words);
    for (std::size_t first = 0; first < count; first += kPiece) {
        const std::size_t some = std::min(kPiece, count - first);
        for (std::size_t i = 0; i < some; ++i) fill(first + i, &piece[i * words]);
        const std::uint64_t bytes = some * words * 4;
        SPLAT_TRY(context.write(to.part(first * words * 4, bytes), piece.data(), bytes));
    }
    return {};
}

std::uint32_t word_of(float value) {
    return std::bit_cast<std::uint32_t>(value);
}

/// The direction, of length 1; 0 for what has none.
std::array<float, 3> unit_of(const std::array<float, 3>& given) {
    const scene::Vec3 v(given[0], given[1], given[2]);
    const double length = glm::length(v);
    if (!(length > 0) || !std::isfinite(length)) return {};
    return {static_cast<float>(v.x / length), static_cast<float>(v.y / length),
            static_cast<float>(v.z / length)};
}

std::uint32_t pair_of(float low, float high) {
    const auto part = [](float v) {
        return static_cast<std::uint32_t>(std::lround(65535 * std::clamp(v, 0.0F, 1.0F)));
    };
    return part(low) | part(high) << 16U;
}

Status write_geometry(vk::Context& context, const scene::TriangleMesh& mesh, MeshOnDevice& to) {
    SPLAT_TRY(check_bytes(context, 16 * mesh.vertices.size(), 16, "vertices"));
    SPLAT_TRY(check_bytes(context, 16 * mesh.triangles.size(), 16, "triangles"));
    SPLAT_SET(to.vertices, allocate(context, 16 * mesh.vertices.size(), "vertices"));
    SPLAT_SET(to.corners, allocate(context, 16 * mesh.triangles.size(), "triangles"));
    const scene::Vec3 center = to.center();
    SPLAT_TRY(write_elements(
        context, to.vertices.range(), mesh.vertices.size(), 4,
        [&](std::size_t i, std::uint32_t* words) {
            constexpr double kMost = (1U << kVertexBits) - 1;  // differences fit 32 bits
            for (std::size_t k = 0; k < 3; ++k) {
                // Vertices that no triangle names may lie anywhere.
                const double units =
                    std::clamp((mesh.vertices[i][k] - center[k]) / to.unit, -kMost, kMost);
                words[k] =
                    static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(units)));
            }
            words[3] = 0;
        }));
    return write_elements(context, to.corners.range(), mesh.triangles.size(), 4,
                          [&](std::size_t i, std::uint32_t* words) {
                              std::ranges::copy(mesh.triangles[i], words);
                              words[3] = mesh.material_of.empty() ? 0 : mesh.material_of[i];
                          });
}

Status write_indices(vk::Context& context, std::span<const scene::Triangle> given, const char* name,
                     std::uint32_t bit, MeshOnDevice& mesh, vk::Buffer& to) {
    if (given.empty()) return {};
    SPLAT_TRY(check_bytes(context, 12 * given.size(), 4, name));
    SPLAT_SET(to, allocate(context, 12 * given.size(), name));
    mesh.bits |= bit;
    return context.write(to.range(), given.data(), 12 * given.size());
}

Status write_attributes(vk::Context& context, const scene::TriangleMesh& mesh, MeshOnDevice& to) {
    const std::uint64_t normals = 3 * mesh.normals.size(), texcoords = 2 * mesh.texcoords.size();
    const std::uint64_t words = normals + texcoords + 2 * mesh.colors.size();
    SPLAT_TRY(check_bytes(context, 4 * words, 4, "normals, texture coordinates and colours"));
    to.texcoords_at = static_cast<std::uint32_t>(normals);
    to.colors_at = static_cast<std::uint32_t>(normals + texcoords);
    if (normals > 0) to.bits |= params::kMeshNormals;
    if (texcoords > 0) to.bits |= params::kMeshTexcoords;
    if (!mesh.colors.empty()) to.bits |= params::kMeshColors;
    SPLAT_SET(to.attributes, allocate(context, 4 * words, "normals"));
    const vk::BufferView all = to.attributes.range();
    SPLAT_TRY(
        write_elements(context, all, mesh.normals.size(), 3, [&](std::size_t i, std::uint32_t* at) {
            std::ranges::transform(unit_of(mesh.normals[i]), at, word_of);
        }));
    SPLAT_TRY(write_elements(context, all.part(4 * normals, 4 * texcoords), mesh.texcoords.size(),
                             2, [&](std::size_t i, std::uint32_t* at) {
                                 for (std::size_t k = 0; k < 2; ++k) {
                                     at[k] = word_of(texture_number(mesh.texcoords[i][k]));
                                 }
                             }));
    return write_elements(context, all.part(4 * (normals + texcoords), 8 * mesh.colors.size()),
                          mesh.colors.size(), 2, [&](std::size_t i, std::uint32_t* at) {
                              const std::array<float, 4>& color = mesh.colors[i];
                              at[0] = pair_of(color[0], color[1]);
                              at[1] = pair_of(color[2], color[3]);
                          });
}

}  // namespace

Result<MeshOnDevice> upload(vk::Context& context, const scene::TriangleMesh& mesh) {
    SPLAT_TRY(scene::check_mesh(mesh));
    const scene::MeshMeasures measures = scene::measure(mesh);
    MeshOnDevice made;
    made.low = measures.low;
    made.high = measures.high;
    for (std::size_t k = 0; k < 3; ++k)
        if (!(made.low[k] >= -kMostCoordinate && made.high[k] <= kMostCoordinate))
            return invalid("the mesh reaches from %g to %g, expected at most %g from the origin",
                           made.low[k], made.high[k], kMostCoordinate);
    const scene::Vec3 sides = made.high - made.low;
    const double half = std::max({sides.x, sides.y, sides.z}) / 2;
    if (half > 0) made.unit = std::ldexp(1.0, std::ilogb(half) + 1 - kVertexBits);
    made.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    made.transparent = std::ranges::any_of(mesh.materials, [](const scene::MeshMaterial& material) {
        return material.alpha != scene::AlphaMode::kOpaque;
    });
    SPLAT_TRY(write_geometry(context, mesh, made));
    SPLAT_TRY(write_indices(context, mesh.normal_indices, "normals' indices",
                            params::kMeshNormalIndices, made, made.normal_indices));
    SPLAT_TRY(write_indices(context, mesh.texcoord_indices, "texture coordinates' indices",
                            params::kMeshTexcoordIndices, made, made.texcoord_indices));
    SPLAT_TRY(write_attributes(context, mesh, made));
    SPLAT_ASSIGN(const PackedMaterials packed, pack_materials(mesh, most_bytes(context, 4) / 4));
    made.textures_at = packed.textures_at;
    if (packed.halved > 0)
        made.note = format("%u of %zu textures are drawn smaller, as all do not fit the device",
                           packed.halved, mesh.textures.size());
    const std::uint64_t bytes = 4 * packed.words.size();
    SPLAT_SET(made.texels, allocate(context, bytes, "textures"));
    SPLAT_TRY(context.write(made.texels.range(), packed.words.data(), bytes));
    return made;
}

}  // namespace splat::triangles
