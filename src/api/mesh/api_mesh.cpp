#include <algorithm>
#include <shared_mutex>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/json_writer.h"
#include "io/mesh/mesh.h"
#include "scene/camera_pose.h"
#include "triangles/renderer.h"

using namespace splat;

namespace {

std::shared_ptr<api::MeshObject> mesh_of(io::LoadedMesh loaded) {
    auto object = std::make_shared<api::MeshObject>();
    object->mesh = std::move(loaded.mesh);
    JsonWriter json;
    json.begin_object().key("warnings").begin_array();
    for (const std::string& what : loaded.ignored) json.value(what);
    json.end().end();
    object->report = json.text();
    return object;
}

/// Copies `count` groups of Size numbers, one for each of `expected` vertices; none is right, too.
template <class Number, std::size_t Size>
Status copy_each(const char* name, const Number* from, std::uint64_t count, std::uint64_t expected,
                 std::vector<std::array<Number, Size>>& to) {
    if (from == nullptr && count != 0)
        return invalid("splat_mesh_desc.%s is NULL, but its count is %llu", name, llu(count));
    if (from == nullptr) return {};
    if (count != Size * expected)
        return invalid(
            "splat_mesh_desc.%s has %llu numbers, expected %zu for each of %llu vertices", name,
            llu(count), Size, llu(expected));
    to.resize(expected);
    for (std::size_t i = 0; i < expected; ++i) std::copy_n(from + Size * i, Size, to[i].begin());
    return {};
}

Status check_threes(const char* name, std::uint64_t count) {
    if (count % 3 == 0) return {};
    return invalid("splat_mesh_desc.%s is %llu, expected 3 numbers each", name, llu(count));
}

Result<scene::Texture> texture_of(const splat_mesh_desc& desc) {
    scene::Texture texture{desc.texture_width, desc.texture_height, {}};
    const std::uint64_t texels = std::uint64_t{texture.width} * texture.height;
    if (texels == 0 || std::max(texture.width, texture.height) > scene::kMaxImageSide)
        return invalid("splat_mesh_desc.texture has %u x %u texels, expected 1 to %u a side",
                       texture.width, texture.height, scene::kMaxImageSide);
    if (desc.texture_count != 4 * texels)
        return invalid("splat_mesh_desc.texture has %llu bytes, expected 4 for each of %llu texels",
                       llu(desc.texture_count), llu(texels));
    texture.texels.resize(texels);
    for (std::size_t i = 0; i < texels; ++i)
        std::copy_n(desc.texture + 4 * i, 4, texture.texels[i].begin());
    return texture;
}

Result<scene::MeshMaterial> material_of(const splat_mesh_desc& desc) {
    scene::MeshMaterial material{.alpha = scene::AlphaMode::kMask};
    for (const float value : desc.base_color)
        if (!(value >= 0 && value <= 1))
            return invalid("splat_mesh_desc.base_color has %g, expected 0 to 1",
                           static_cast<double>(value));
    if (std::ranges::any_of(desc.base_color, [](float value) { return value != 0; }))
        std::ranges::copy(desc.base_color, material.color.begin());
    material.double_sided = (desc.flags & SPLAT_MESH_SINGLE_SIDED) == 0;
    return material;
}

Result<scene::TriangleMesh> mesh_of(const splat_mesh_desc& desc) {
    scene::TriangleMesh mesh;
    SPLAT_TRY(api::require(desc.vertices, "splat_mesh_desc.vertices", desc.triangles,
                           "splat_mesh_desc.triangles"));
    SPLAT_TRY(check_threes("vertex_count", desc.vertex_count));
    SPLAT_TRY(check_threes("triangle_count", desc.triangle_count));
    const std::uint64_t vertices = desc.vertex_count / 3, triangles = desc.triangle_count / 3;
    if (std::max(vertices, triangles) > UINT32_MAX)
        return invalid("splat_mesh_desc has %llu vertices and %llu triangles, expected below 2^32",
                       llu(vertices), llu(triangles));
    mesh.vertices.reserve(vertices);
    for (std::uint64_t i = 0; i < vertices; ++i)
        mesh.vertices.push_back(glm::make_vec3(desc.vertices + 3 * i));
    mesh.triangles.resize(triangles);
    for (std::uint64_t i = 0; i < triangles; ++i)
        std::copy_n(desc.triangles + 3 * i, 3, mesh.triangles[i].begin());
    SPLAT_TRY(copy_each("normals", desc.normals, desc.normal_count, vertices, mesh.normals));
    SPLAT_TRY(
        copy_each("texcoords", desc.texcoords, desc.texcoord_count, vertices, mesh.texcoords));
    SPLAT_TRY(copy_each("colors", desc.colors, desc.color_count, vertices, mesh.colors));
    SPLAT_ASSIGN(scene::MeshMaterial material, material_of(desc));
    if (desc.texture != nullptr || desc.texture_count != 0) {
        SPLAT_TRY(api::require(desc.texture, "splat_mesh_desc.texture"));
        SPLAT_ASSIGN(scene::Texture texture, texture_of(desc));
        mesh.textures.push_back(std::move(texture));
        material.texture = 0;
    }
    mesh.materials.push_back(material);
    SPLAT_TRY(scene::check_mesh(mesh));
    return mesh;
}

splat_mesh_info info_of(const scene::TriangleMesh& mesh) {
    splat_mesh_info info{};
    info.materials = static_cast<std::uint32_t>(mesh.materials.size());
    info.textures = static_cast<std::uint32_t>(mesh.textures.size());
    info.vertices = mesh.vertices.size();
    info.triangles = mesh.triangles.size();
    for (const scene::Texture& texture : mesh.textures) info.texels += texture.texels.size();
    const scene::MeshMeasures measures = scene::measure(mesh);
    std::copy_n(glm::value_ptr(measures.low), 3, info.low);
    std::copy_n(glm::value_ptr(measures.high), 3, info.high);
    SPLAT_COPY(info, measures, area, zero_area, unused);
    info.device_bytes = triangles::device_bytes(mesh, 128, 128, {});
    return info;
}

static_assert(static_cast<int>(scene::MeshSize::kAsGiven) == SPLAT_MESH_AS_GIVEN);
static_assert(static_cast<int>(scene::MeshSize::kUnitCube) == SPLAT_MESH_UNIT_CUBE);
static_assert(static_cast<int>(scene::MeshSize::kUnitDiagonal) == SPLAT_MESH_UNIT_DIAGONAL);
static_assert(static_cast<int>(scene::MeshSize::kUnitSphere) == SPLAT_MESH_UNIT_SPHERE);

}  // namespace

splat_result splat_mesh_load(const char* path, const splat_mesh_file_desc* desc, splat_mesh* mesh) {
    return api::create(mesh, [&]() -> api::Meshes::Made {
        SPLAT_TRY(api::require(path, "path"));
        io::MeshOptions options;
        if (desc != nullptr) {
            SPLAT_TRY(api::check_desc(desc, SPLAT_MESH_LENIENT));
            if (desc->max_triangles != 0) options.max_triangles = desc->max_triangles;
            if (desc->max_texels != 0) options.max_texels = desc->max_texels;
            options.lenient = (desc->flags & SPLAT_MESH_LENIENT) != 0;
        }
        SPLAT_ASSIGN(io::LoadedMesh loaded, io::load_mesh(path, options));
        return mesh_of(std::move(loaded));
    });
}

splat_result splat_mesh_create(const splat_mesh_desc* desc, splat_mesh* mesh) {
    return api::create(mesh, [&]() -> api::Meshes::Made {
        SPLAT_TRY(api::check_desc(desc, SPLAT_MESH_SINGLE_SIDED));
        SPLAT_ASSIGN(scene::TriangleMesh made, mesh_of(*desc));
        return mesh_of({std::move(made), {}});
    });
}

splat_result splat_mesh_load_report(splat_mesh mesh, char* buffer, size_t capacity,
                                    size_t* needed) {
    return api::report(mesh, buffer, capacity, needed, [](auto& object) { return object.report; });
}

splat_result splat_mesh_get_info(splat_mesh mesh, splat_mesh_info* info) {
    return api::describe(mesh, info, "info", [](auto& object) {
        const std::shared_lock lock(object.mutex);
        return info_of(object.mesh);
    });
}

splat_result splat_mesh_normalise(splat_mesh mesh, splat_mesh_size size) {
    return api::with(mesh, [&](const auto& object) -> Status {
        if (size < SPLAT_MESH_AS_GIVEN || size > SPLAT_MESH_UNIT_SPHERE)
            return invalid("size is %d, expected SPLAT_MESH_AS_GIVEN to SPLAT_MESH_UNIT_SPHERE",
                           size);
        const std::lock_guard lock(object->mutex);
        return scene::normalise(object->mesh, static_cast<scene::MeshSize>(size));
    });
}

splat_result splat_mesh_sample(splat_mesh mesh, uint64_t seed, float* points, uint64_t count) {
    return api::with(mesh, [&](const auto& object) -> Status {
        if (count > 0) SPLAT_TRY(api::require(points, "points"));
        if (count % 3 != 0)
            return invalid("count is %llu, expected 3 numbers for each point", llu(count));
        const std::shared_lock lock(object->mutex);
        SPLAT_ASSIGN(const std::vector<scene::Vec3> made,
                     scene::sample_surface(object->mesh, count / 3, seed));
        for (std::size_t i = 0; i < count; ++i) points[i] = static_cast<float>(made[i / 3][i % 3]);
        return {};
    });
}
