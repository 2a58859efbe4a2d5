// Triangles of glTF, where the nodes of the scene place them.

#include <algorithm>
#include <cmath>

#include "core/shown.h"
#include "io/mesh/gltf_surface.h"
#include "io/reader.h"

namespace splat::io {
namespace gltf {
namespace {

using scene::kNone;
using scene::Mat3;
using scene::Vec3;

enum Topology : std::uint64_t { kList = 4, kStrip = 5, kFan = 6 };

/// A primitive of triangles whose attributes have been checked.
struct SurfacePart {
    std::string where;
    Accessor position;
    std::optional<Accessor> normal, texcoord, color, indices;
    /// The numbers of the four accessors, which primitives often share.
    std::array<std::uint64_t, 4> vertex_source{};
    std::uint64_t topology = kList;
    std::uint64_t triangles = 0;
    std::uint32_t material = 0;
};

constexpr std::string_view kNormals[] = {"float", "normalized byte", "normalized short"};
constexpr std::string_view kFractions[] = {"float", "normalized unsigned byte",
                                           "normalized unsigned short"};

/// Reads the primitives of a document, and collects what is ignored.
class SurfaceParts {
  public:
    SurfaceParts(Document& document, const MeshOptions& options, bool quantized, LoadedMesh& to)
        : document_(document),
          options_(options),
          quantized_(quantized),
          to_(to),
          materials_(document, options, to) {}

    /// The primitives of triangles of a mesh. Errors: kFormat, kUnsupported.
    Result<const std::vector<SurfacePart>*> of_mesh(std::uint64_t mesh) {
        const auto [place, is_new] = meshes_.try_emplace(mesh);
        if (!is_new) return &place->second;
        SPLAT_ASSIGN(const JsonTree* const json, document_.element("meshes", mesh));
        const JsonTree::List& primitives = (*json)["primitives"].items();
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            SurfacePart part;
            part.where = format("meshes[%llu].primitives[%zu]", llu(mesh), i);
            SPLAT_SET(part.topology, whole_number(primitives[i], "mode", part.where, kList));
            if (part.topology > kFan)
                return damaged("gltf: %s: mode %llu, expected 0 to 6", part.where.c_str(),
                               llu(part.topology));
            if (part.topology < kList) {
                to_.ignored.insert("primitives of points and lines");
                continue;
            }
            SPLAT_TRY(read(primitives[i], part));
            place->second.push_back(std::move(part));
        }
        return &place->second;
    }

  private:
    Status read(const JsonTree& json, SurfacePart& to);
    Status read_looks(const JsonTree& json, SurfacePart& to);

    /// An attribute of vertices, and the number of its accessor.
    Result<Accessor> attribute(const JsonTree& attributes, const std::string& name,
                               std::size_t components, Encodings encodings, const SurfacePart& of,
                               std::uint64_t& source) {
        SPLAT_SET(source, whole_number(attributes, name.c_str(), of.where));
        ++source;  // 0: none
        return attribute_at(document_, attributes, name, components, encodings, of.position.count,
                            of.where);
    }

    Document& document_;
    const MeshOptions& options_;
    bool quantized_;
    LoadedMesh& to_;
    SurfaceMaterials materials_;
    std::map<std::uint64_t, std::vector<SurfacePart>> meshes_;
};

Status SurfaceParts::read(const JsonTree& json, SurfacePart& to) {
    const JsonTree& attributes = json["attributes"];
    if (!attributes.is_object()) return damaged("gltf: %s: no attributes", to.where.c_str());
    SPLAT_SET(to.position, attribute(attributes, "POSITION", 3, quantized_or(quantized_, kFloat),
                                     to, to.vertex_source[0]));
    std::uint64_t corners = to.position.count;
    if (json.find("indices") != nullptr) {
        SPLAT_ASSIGN(const std::uint64_t index, whole_number(json, "indices", to.where));
        auto found = accessor_at(document_, index);
        if (!found.ok())
            return Status(found.status().code(),
                          to.where + ": indices: " + found.status().message());
        to.indices = std::move(found.value());
        corners = to.indices->count;
    }
    if (corners < 3 || (to.topology == kList && corners % 3 != 0))
        return damaged("gltf: %s: %llu corners, expected %s", to.where.c_str(), llu(corners),
                       to.topology == kList ? "3 for each triangle" : "3 or more");
    to.triangles = to.topology == kList ? corners / 3 : corners - 2;
    if (json.find("targets") != nullptr) to_.ignored.insert("morph targets");
    if (attributes.find("JOINTS_0") != nullptr) to_.ignored.insert("skins");
    if (options_.surface_only) return {};
    return read_looks(json, to);
}

Status SurfaceParts::read_looks(const JsonTree& json, SurfacePart& to) {
    const JsonTree& attributes = json["attributes"];
    std::optional<std::uint64_t> index;
    if (json.find("material") != nullptr)
        SPLAT_SET(index, whole_number(json, "material", to.where));
    SPLAT_ASSIGN(const SurfaceMaterials::Found material, materials_.find(index));
    to.material = material.index;
    if (attributes.find("NORMAL") != nullptr)
        SPLAT_SET(to.normal, attribute(attributes, "NORMAL", 3, kNormals, to, to.vertex_source[1]));
    const std::string set = format("TEXCOORD_%llu", llu(material.texcoord_set));
    if (material.textured) {
        SPLAT_SET(to.texcoord, attribute(attributes, set, 2, quantized_or(quantized_, kFractions),
                                         to, to.vertex_source[2]));
    }
    if (attributes.find("COLOR_0") == nullptr) return {};
    SPLAT_ASSIGN(const std::uint64_t color, whole_number(attributes, "COLOR_0", to.where));
    SPLAT_ASSIGN(const JsonTree* const accessor, document_.element("accessors", color));
    const std::string* const type = (*accessor)["type"].text();
    SPLAT_SET(to.color, attribute(attributes, "COLOR_0", type != nullptr && *type == "VEC3" ? 3 : 4,
                                  kFractions, to, to.vertex_source[3]));
    return {};
}

/// A primitive, and where it is.
struct PlacedPart {
    const SurfacePart* part;
    const Placement* placement;
};

/// Puts placed primitives into one mesh.
class SurfaceBuilder {
  public:
    explicit SurfaceBuilder(LoadedMesh& to) : to_(to), mesh_(to.mesh) {}

    /// Counts what all parts take, then reserves it. Errors: kUnsupported above the limits; as DecodeBudget::take().
    Status reserve(const std::vector<PlacedPart>& parts, const MeshOptions& options,
                   DecodeBudget& budget);

    /// Errors: kFormat for indices and positions.
    Status append(const PlacedPart& placed);

    /// Adds what had to be left out of numbers to `ignored`.
    void finish() {
        if (bad_normals_ > 0)
            to_.ignored.insert(format("%zu normals that are not finite", bad_normals_));
        if (bad_texcoords_ > 0)
            to_.ignored.insert(
                format("%zu texture coordinates that are not finite", bad_texcoords_));
    }

  private:
    Status append_vertices(const SurfacePart& part, const Placement& at);
    Status append_normals(const SurfacePart& part, const Mat3& linear);
    Status append_looks(const SurfacePart& part);
    Status append_triangles(const SurfacePart& part, std::uint32_t base, bool mirrored);
    Status append_indices(const SurfacePart& part, std::vector<std::uint32_t>& corners);

    LoadedMesh& to_;
    scene::TriangleMesh& mesh_;
    bool with_normals_ = false, with_texcoords_ = false, with_colors_ = false;
    std::size_t bad_normals_ = 0, bad_texcoords_ = 0;
    std::vector<float> numbers_;  ///< one attribute's
    /// Where the vertices of a source are, in the placement that is being read.
    std::map<std::array<std::uint64_t, 4>, std::uint32_t> bases_;
    const Placement* placement_ = nullptr;
};

Status SurfaceBuilder::reserve(const std::vector<PlacedPart>& parts, const MeshOptions& options,
                               DecodeBudget& budget) {
    std::uint64_t vertices = 0, triangles = 0, most = 0;
    std::set<std::array<std::uint64_t, 4>> seen;
    const Placement* placement = nullptr;
    for (const auto& [part, at] : parts) {
        if (at != placement) seen.clear();
        placement = at;
        constexpr std::uint64_t kFull = std::uint64_t{1} << 60U;  // more than any budget
        triangles = std::min(triangles, kFull) + part->triangles;
        most = std::max(
            {most, part->position.count, part->topology == kList ? 0 : part->triangles + 2});
        if (seen.insert(part->vertex_source).second)
            vertices = std::min(vertices, kFull) + part->position.count;
        with_normals_ = with_normals_ || part->normal;
        with_texcoords_ = with_texcoords_ || part->texcoord;
        with_colors_ = with_colors_ || part->color;
    }
    if (triangles > options.max_triangles || vertices >= kNone)
        return unsupported("gltf: %llu triangles of %llu vertices, expected at most %llu and %u",
                           llu(triangles), llu(vertices), llu(options.max_triangles), kNone - 1);
    const std::size_t each = sizeof(Vec3) + (with_normals_ ? 12U : 0U) +
                             (with_texcoords_ ? 8U : 0U) + (with_colors_ ? 16U : 0U);
    SPLAT_TRY(budget.take(vertices, each, "gltf: vertices"));
    SPLAT_TRY(budget.take(most, 4 * sizeof(float), "gltf: numbers of a primitive"));
    SPLAT_TRY(
        budget.take(triangles, sizeof(scene::Triangle) + sizeof(std::uint32_t), "gltf: triangles"));
    const auto count = static_cast<std::size_t>(vertices);
    mesh_.vertices.reserve(count);
    if (with_normals_) mesh_.normals.reserve(count);
    if (with_texcoords_) mesh_.texcoords.reserve(count);
    if (with_colors_) mesh_.colors.reserve(count);
    mesh_.triangles.reserve(static_cast<std::size_t>(triangles));
    if (!options.surface_only) mesh_.material_of.reserve(static_cast<std::size_t>(triangles));
    return {};
}

Status SurfaceBuilder::append_vertices(const SurfacePart& part, const Placement& at) {
    const auto count = static_cast<std::size_t>(part.position.count);
    numbers_.resize(count * 3);
    SPLAT_TRY(copy_numbers(part.position, numbers_.data(), 3));
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 position = glm::make_vec3(&numbers_[3 * i]);
        const Vec3 placed = at.linear * position + at.move;
        if (!scene::is_finite(placed))
            return damaged("gltf: %s: position %zu is not finite%s", part.where.c_str(), i,
                           scene::is_finite(position) ? " where its node has it" : "");
        mesh_.vertices.push_back(placed);
    }
    if (with_normals_) SPLAT_TRY(append_normals(part, at.linear));
    return append_looks(part);
}

/// Normals turn as surfaces do: with the cofactors of the transform, whose scale does not count.
Status SurfaceBuilder::append_normals(const SurfacePart& part, const Mat3& linear) {
    const auto count = static_cast<std::size_t>(part.position.count);
    if (!part.normal) {
        mesh_.normals.resize(mesh_.normals.size() + count);
        return {};
    }
    numbers_.resize(count * 3);
    SPLAT_TRY(copy_numbers(*part.normal, numbers_.data(), 3));
    const double sign = glm::determinant(linear) < 0 ? -1 : 1;
    const Mat3 cofactors = sign * glm::transpose(scene::adjugate(linear));
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 normal = glm::make_vec3(&numbers_[3 * i]);
        const Vec3 turned = cofactors * normal;
        const double length = glm::length(turned);
        std::array<float, 3> kept{};
        if (!scene::is_finite(normal))
            ++bad_normals_;
        else if (length > 0 && std::isfinite(length))
            for (std::size_t k = 0; k < 3; ++k) kept[k] = static_cast<float>(turned[k] / length);
        mesh_.normals.push_back(kept);
    }
    return {};
}

Status SurfaceBuilder::append_looks(const SurfacePart& part) {
    const auto count = static_cast<std::size_t>(part.position.count);
    if (with_texcoords_) {
        const std::size_t first = mesh_.texcoords.size();
        mesh_.texcoords.resize(first + count);
        if (part.texcoord) SPLAT_TRY(copy_numbers(*part.texcoord, &mesh_.texcoords[first][0], 2));
        for (std::size_t i = first; i < mesh_.texcoords.size(); ++i) {
            auto& at = mesh_.texcoords[i];
            if (std::isfinite(at[0]) && std::isfinite(at[1])) continue;
            at = {};
            ++bad_texcoords_;
        }
    }
    if (!with_colors_) return {};
    const std::size_t first = mesh_.colors.size();
    mesh_.colors.resize(first + count, {1, 1, 1, 1});
    if (part.color) SPLAT_TRY(copy_numbers(*part.color, &mesh_.colors[first][0], 4));
    for (std::size_t i = first; i < mesh_.colors.size(); ++i)
        for (const float value : mesh_.colors[i])
            if (!(value >= 0 && value <= 1))
                return damaged("gltf: %s: colour %zu has %g, expected 0 to 1", part.where.c_str(),
                               i - first, static_cast<double>(value));
    return {};
}

/// The corners of a primitive, by the numbers of its vertices.
Status SurfaceBuilder::append_indices(const SurfacePart& part,
                                      std::vector<std::uint32_t>& corners) {
    if (part.indices) {
        corners.resize(static_cast<std::size_t>(part.indices->count));
        SPLAT_TRY(copy_indices(*part.indices, corners.data()));
    } else {
        corners.resize(static_cast<std::size_t>(part.position.count));
        for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<std::uint32_t>(i);
    }
    return {};
}

Status SurfaceBuilder::append_triangles(const SurfacePart& part, std::uint32_t base,
                                        bool mirrored) {
    const std::size_t first = mesh_.triangles.size();
    const auto count = static_cast<std::size_t>(part.triangles);
    mesh_.triangles.resize(first + count);
    if (part.topology == kList && part.indices) {
        SPLAT_TRY(copy_indices(*part.indices, &mesh_.triangles[first][0]));
    } else {
        std::vector<std::uint32_t> corners;
        SPLAT_TRY(append_indices(part, corners));
        for (std::size_t i = 0; i < count; ++i) {
            std::array<std::size_t, 3> of = {3 * i, 3 * i + 1, 3 * i + 2};
            if (part.topology == kStrip) of = {i, i + 1 + i % 2, i + 2 - i % 2};
            if (part.topology == kFan) of = {i + 1, i + 2, 0};
            for (std::size_t k = 0; k < 3; ++k) mesh_.triangles[first + i][k] = corners[of[k]];
        }
    }
    for (std::size_t i = first; i < mesh_.triangles.size(); ++i) {
        scene::Triangle& triangle = mesh_.triangles[i];
        for (std::uint32_t& index : triangle) {
            if (index >= part.position.count)
                return damaged("gltf: %s: triangle %zu names vertex %u, but there are %llu",
                               part.where.c_str(), i - first, index, llu(part.position.count));
            index += base;
        }
        // A node that mirrors turns the corners, which tell what is in front.
        if (mirrored) std::swap(triangle[1], triangle[2]);
    }
    return {};
}

Status SurfaceBuilder::append(const PlacedPart& placed) {
    const SurfacePart& part = *placed.part;
    if (placed.placement != placement_) bases_.clear();
    placement_ = placed.placement;
    const auto [base, is_new] =
        bases_.try_emplace(part.vertex_source, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) SPLAT_TRY(append_vertices(part, *placed.placement));
    SPLAT_TRY(append_triangles(part, base->second, glm::determinant(placed.placement->linear) < 0));
    if (!mesh_.materials.empty()) mesh_.material_of.resize(mesh_.triangles.size(), part.material);
    return {};
}

bool is_read_of_meshes(std::string_view name) {
    return name == "KHR_mesh_quantization" || name == "KHR_texture_transform" ||
           name == "EXT_texture_webp" || name == "KHR_materials_pbrSpecularGlossiness";
}

bool is_harmless_of_meshes(std::string_view name) {
    return is_read_of_meshes(name) || name.starts_with("KHR_materials_") ||
           name == "KHR_lights_punctual";
}

/// Instances of a mesh: without them most of a scene is not there.
Status check_instances(const JsonTree& json) {
    for (const JsonTree& name : json["extensionsUsed"].items())
        if (name.text() != nullptr && *name.text() == "EXT_mesh_gpu_instancing")
            return unsupported(
                "gltf: the file uses EXT_mesh_gpu_instancing, which is not read; write a node for "
                "each instance");
    return {};
}

Status read_surfaces(Document& document, const MeshOptions& options, LoadedMesh& to) {
    const JsonTree& json = document.json();
    SPLAT_TRY(check_instances(json));
    SPLAT_ASSIGN(const bool quantized,
                 check_extensions(json, {is_read_of_meshes, is_harmless_of_meshes}, to.ignored));
    SPLAT_ASSIGN(const std::vector<Placement> placements, placed_meshes(document, to.ignored));
    SurfaceParts reader(document, options, quantized, to);
    std::vector<PlacedPart> parts;
    std::uint64_t count = 0;
    for (const Placement& placement :
         placements) {  // all files are read before the budget is known
        SPLAT_ASSIGN(const auto* const found, reader.of_mesh(placement.mesh));
        count += found->size();
    }
    DecodeBudget budget(document.file_bytes(), options.limits);
    SPLAT_TRY(budget.take(count, sizeof(PlacedPart), "gltf: primitives"));
    for (const Placement& placement : placements) {
        SPLAT_ASSIGN(const auto* const found, reader.of_mesh(placement.mesh));
        for (const SurfacePart& part : *found) parts.push_back({&part, &placement});
    }
    if (parts.empty())
        return damaged("gltf: no mesh of the scene has triangles%s",
                       json["extensionsUsed"].items().empty()
                           ? ""
                           : "; is it a scene of Gaussians, or has an extension what is shown?");
    SurfaceBuilder builder(to);
    SPLAT_TRY(builder.reserve(parts, options, budget));
    for (const PlacedPart& part : parts) SPLAT_TRY(builder.append(part));
    builder.finish();
    for (const char* const name : {"animations", "cameras"})
        if (!json[name].items().empty()) to.ignored.insert(name);
    return {};
}

}  // namespace
}  // namespace gltf

Result<LoadedMesh> read_gltf_mesh(Bytes file, const MeshOptions& options) {
    LoadOptions load;
    load.limits = options.limits;
    load.lenient = options.lenient;
    load.folder = options.folder;
    LoadReport report;
    gltf::Chunks chunks{.json = file, .binary = {}};
    if (as_text(file).starts_with("glTF")) SPLAT_SET(chunks, gltf::chunks_of(file, load, report));
    SPLAT_ASSIGN(gltf::Document document,
                 gltf::Document::open(as_text(*chunks.json), chunks.binary, load));
    LoadedMesh to;
    to.ignored.insert(report.ignored.begin(), report.ignored.end());
    if (!report.left_out.empty()) to.ignored.insert(report.left_out);
    SPLAT_TRY(gltf::read_surfaces(document, options, to));
    return to;
}

}  // namespace splat::io
