// Reading: primitives with KHR_gaussian_splatting as Gaussians, and the chunks of a .glb.

#include <algorithm>
#include <array>
#include <cmath>

#include "core/shown.h"
#include "io/reader.h"
#include "io/scene_file.h"
#include "io/scene_formats.h"
#include "io/scenes/gltf.h"
#include "scene/arrays.h"

namespace splat::io {
namespace gltf {
namespace {

using scene::Gaussians;

/// A primitive whose attributes have been checked.
struct Primitive {
    std::uint64_t count = 0;
    bool linear_colors = false;
    Accessor position, rotation, scale, opacity;
    std::vector<Accessor> sh;  ///< the coefficients of whole degrees
    std::string where;

    [[nodiscard]] std::uint32_t degree() const {
        std::uint32_t degree = 0;
        while (scene::sh_coefficients(degree) < sh.size()) ++degree;
        return degree;
    }
};

constexpr std::string_view kRotations[] = {"float", "normalized byte", "normalized short"};
constexpr std::string_view kScales[] = {"float", "unsigned byte", "normalized unsigned byte",
                                        "unsigned short", "normalized unsigned short"};
constexpr std::string_view kOpacities[] = {"float", "normalized unsigned byte",
                                           "normalized unsigned short"};

/// Reads the primitives of a document, and collects what is ignored.
class Primitives {
  public:
    Primitives(Document& document, std::set<std::string>& ignored, bool quantized)
        : document_(document), ignored_(ignored), quantized_(quantized) {}

    /// The Gaussians of a mesh. Errors: kFormat, kUnsupported.
    Result<const std::vector<Primitive>*> of_mesh(std::uint64_t mesh);

  private:
    Result<Primitive> read(const JsonTree& json, const JsonTree& extension, std::string where);
    Status read_extension(const JsonTree& extension, Primitive& to);
    Result<Accessor> attribute(const JsonTree& attributes, const std::string& name,
                               std::size_t components, Encodings encodings, const Primitive& of) {
        return attribute_at(document_, attributes, name, components, encodings, of.count, of.where);
    }
    Status read_harmonics(const JsonTree& attributes, Primitive& to);
    Status ignore_others(const JsonTree& attributes, const Primitive& of);

    Document& document_;
    std::set<std::string>& ignored_;
    bool quantized_;
    std::map<std::uint64_t, std::vector<Primitive>> meshes_;
};

std::string own(const std::string& name) {
    return std::string(kExtension) + ":" + name;
}

std::string harmonic(std::uint32_t degree, std::uint32_t order) {
    return own(format("SH_DEGREE_%u_COEF_%u", degree, order));
}

Status Primitives::read_extension(const JsonTree& extension, Primitive& to) {
    const std::string* const colors = extension["colorSpace"].text();
    to.linear_colors = colors != nullptr && *colors == "lin_rec709_display";
    if (colors == nullptr || (!to.linear_colors && *colors != "srgb_rec709_display"))
        return unsupported(
            "gltf: %s: colorSpace '%s', expected srgb_rec709_display or lin_rec709_display",
            to.where.c_str(), colors == nullptr ? "" : shown(*colors, 60).c_str());
    // The extension lets a program that does not know a kernel take this one.
    const std::pair<const char*, const char*> known[] = {
        {"kernel", "ellipse"}, {"projection", "perspective"}, {"sortingMethod", "cameraDistance"}};
    for (const auto& [name, value] : known) {
        const std::string* const text = extension[name].text();
        if (text != nullptr && *text != value)
            ignored_.insert(format("%s '%s', read as %s", name, shown(*text, 60).c_str(), value));
        else if (text == nullptr && (extension.find(name) != nullptr || name == known[0].first))
            return damaged("gltf: %s: no %s, expected '%s'", to.where.c_str(), name, value);
    }
    if (extension.find("extensions") != nullptr)
        ignored_.insert("extensions of " + std::string(kExtension));
    return {};
}

Status Primitives::read_harmonics(const JsonTree& attributes, Primitive& to) {
    bool ended = false;
    for (std::uint32_t degree = 0; degree <= scene::kMaxShDegree; ++degree) {
        std::uint32_t present = 0;
        for (std::uint32_t order = 0; order < 2 * degree + 1; ++order)
            present += attributes.find(harmonic(degree, order)) != nullptr ? 1 : 0;
        const bool whole = present == 2 * degree + 1;
        if ((present != 0 && (!whole || ended)) || (degree == 0 && !whole))
            return damaged(
                "gltf: %s: %u of %u harmonics of degree %u%s, expected whole degrees from 0 on",
                to.where.c_str(), present, 2 * degree + 1, degree,
                ended ? ", but not all of the degree below" : "");
        ended = !whole;
        for (std::uint32_t order = 0; whole && order < 2 * degree + 1; ++order) {
            SPLAT_ASSIGN(Accessor read,
                         attribute(attributes, harmonic(degree, order), 3, kFloat, to));
            to.sh.push_back(std::move(read));
        }
    }
    return {};
}

Status Primitives::ignore_others(const JsonTree& attributes, const Primitive& of) {
    const auto* const members = std::get_if<JsonTree::Object>(&attributes.value);
    if (members == nullptr) return damaged("gltf: %s: no attributes", of.where.c_str());
    std::set<std::string> known = {"POSITION", "COLOR_0", own("ROTATION"), own("SCALE"),
                                   own("OPACITY")};
    for (std::uint32_t degree = 0; degree <= scene::kMaxShDegree; ++degree)
        for (std::uint32_t order = 0; order < 2 * degree + 1; ++order)
            known.insert(harmonic(degree, order));
    for (const JsonTree::Member& member : *members)
        if (!known.contains(member.name)) ignored_.insert("attribute " + shown(member.name, 80));
    return {};
}

Result<Primitive> Primitives::read(const JsonTree& json, const JsonTree& extension,
                                   std::string where) {
    Primitive to;
    to.where = std::move(where);
    SPLAT_ASSIGN(const std::uint64_t mode, whole_number(json, "mode", to.where, 4));
    if (mode != 0)
        return damaged("gltf: %s: mode %llu, expected 0 (points) for %s", to.where.c_str(),
                       llu(mode), kExtension);
    if (json.find("indices") != nullptr)
        return unsupported("gltf: %s: indices, expected points without them", to.where.c_str());
    if (json.find("targets") != nullptr) ignored_.insert("morph targets");
    SPLAT_TRY(read_extension(extension, to));
    const JsonTree& attributes = json["attributes"];
    SPLAT_TRY(ignore_others(attributes, to));
    SPLAT_SET(to.position,
              attribute(attributes, "POSITION", 3, quantized_or(quantized_, kFloat), to));
    to.count = to.position.count;
    SPLAT_SET(to.rotation, attribute(attributes, own("ROTATION"), 4, kRotations, to));
    SPLAT_SET(to.scale, attribute(attributes, own("SCALE"), 3, kScales, to));
    SPLAT_SET(to.opacity, attribute(attributes, own("OPACITY"), 1, kOpacities, to));
    SPLAT_TRY(read_harmonics(attributes, to));
    return to;
}

Result<const std::vector<Primitive>*> Primitives::of_mesh(std::uint64_t mesh) {
    const auto [place, is_new] = meshes_.try_emplace(mesh);
    if (!is_new) return &place->second;
    SPLAT_ASSIGN(const JsonTree* const json, document_.element("meshes", mesh));
    const JsonTree::List& primitives = (*json)["primitives"].items();
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        const JsonTree* const extension = primitives[i]["extensions"].find(kExtension);
        if (extension == nullptr) {
            ignored_.insert(std::string("primitives without ") + kExtension);
            continue;
        }
        SPLAT_ASSIGN(Primitive read, read(primitives[i], *extension,
                                          format("meshes[%llu].primitives[%zu]", llu(mesh), i)));
        place->second.push_back(std::move(read));
    }
    return &place->second;
}

/// The Gaussians of a primitive, with the degree of the scene.
Result<Gaussians> decode(const Primitive& from, std::uint32_t degree,
                         std::set<std::string>& ignored) {
    Gaussians g = scene::make_gaussians(static_cast<std::size_t>(from.count), degree);
    SPLAT_TRY(copy_numbers(from.position, g.means.data(), 3));
    SPLAT_TRY(copy_numbers(from.rotation, g.rotations.data(), 4));
    SPLAT_TRY(copy_numbers(from.scale, g.log_scales.data(), 3));
    SPLAT_TRY(copy_numbers(from.opacity, g.opacity_logits.data(), 1));
    const std::size_t each = std::size_t{scene::sh_coefficients(degree)} * 3;
    for (std::size_t k = 0; k < from.sh.size(); ++k)
        SPLAT_TRY(copy_numbers(from.sh[k], g.sh.data() + 3 * k, each));
    for (std::size_t i = 0; i < g.count(); ++i) {
        float* const xyzw = &g.rotations[4 * i];
        std::rotate(xyzw, xyzw + 3, xyzw + 4);
        const auto opacity = static_cast<double>(g.opacity_logits[i]);
        if (opacity < 0 || opacity > 1)
            return damaged("gltf: %s: opacity %g of Gaussian %zu, expected 0 to 1",
                           from.where.c_str(), opacity, i);
        g.opacity_logits[i] = static_cast<float>(scene::logit_of(opacity));
    }
    // Linear scales are never negative. Drafts of the extension, before the issue 2563 of KhronosGroup/glTF, had
    // their logarithms.
    if (std::ranges::any_of(g.log_scales, [](float scale) { return scale < 0; }))
        ignored.insert("linear scales (some are negative: read as logarithms, as in drafts)");
    else
        for (float& scale : g.log_scales)
            scale = static_cast<float>(std::log(static_cast<double>(scale)));
    return g;
}

bool is_of_gaussians(std::string_view name) {
    return name == kExtension || name == "KHR_mesh_quantization";
}

/// Extensions that say nothing of Gaussians: the extension has materials ignored.
bool may_be_required(std::string_view name) {
    return is_of_gaussians(name) || name.starts_with("KHR_materials_") ||
           name == "KHR_texture_transform";
}

bool has_extras(const JsonTree& tree) {
    if (const auto* const members = std::get_if<JsonTree::Object>(&tree.value))
        return std::ranges::any_of(*members, [](const JsonTree::Member& member) {
            return member.name == "extras" || has_extras(member.tree);
        });
    return std::ranges::any_of(tree.items(), has_extras);
}

void ignore_the_rest(const JsonTree& json, std::set<std::string>& ignored) {
    for (const char* const name :
         {"animations", "cameras", "images", "materials", "samplers", "skins", "textures"})
        if (!json[name].items().empty()) ignored.insert(name);
    if (has_extras(json)) ignored.insert("extras");
}

bool uses_extension(const JsonTree& json) {
    return std::ranges::any_of(json["extensionsUsed"].items(), [](const JsonTree& name) {
        return name.text() != nullptr && *name.text() == kExtension;
    });
}

struct Part {
    const Primitive* primitive;
    const Placement* placement;
};

constexpr std::uint64_t kManyGaussians = std::uint64_t{1} << 60U;  ///< more than any budget

/// What the placed meshes have. Errors: as of_mesh(); before any allocation for Gaussians, as check_count().
Result<std::vector<Part>> parts_of(const std::vector<Placement>& placed, Primitives& primitives,
                                   const LoadOptions& options, DecodeBudget& budget) {
    std::vector<Part> parts;
    std::uint64_t count = 0;
    std::uint64_t most = 0;
    std::uint32_t degree = 0;
    for (const Placement& placement : placed) {
        SPLAT_ASSIGN(const auto* const found, primitives.of_mesh(placement.mesh));
        SPLAT_TRY(budget.take(found->size(), sizeof(Part), "gltf: primitives"));
        for (const Primitive& primitive : *found) {
            count = std::min(count, kManyGaussians) + primitive.count;  // without an overflow
            most = std::max(most, primitive.count);
            degree = std::max(degree, primitive.degree());
            parts.push_back({&primitive, &placement});
            if (primitive.linear_colors != parts.front().primitive->linear_colors)
                return unsupported(
                    "gltf: %s has another colorSpace than %s, expected one for all Gaussians",
                    primitive.where.c_str(), parts.front().primitive->where.c_str());
        }
    }
    SPLAT_TRY(check_count(count, degree, options, budget, "gltf"));
    if (parts.size() > 1) SPLAT_TRY(check_count(most, degree, options, budget, "gltf"));
    return parts;
}

void append(Gaussians& to, const Gaussians& part) {
    const auto add = [](std::vector<float>& all, const std::vector<float>& more) {
        all.insert(all.end(), more.begin(), more.end());
    };
    for (const scene::Attribute& attribute : scene::attributes(to.sh_degree))
        add(to.*attribute.array, part.*attribute.array);
}

Result<Gaussians> gather_parts(const std::vector<Part>& parts, std::set<std::string>& ignored) {
    std::uint64_t count = 0;
    std::uint32_t degree = 0;
    for (const Part& part : parts) {
        count += part.primitive->count;
        degree = std::max(degree, part.primitive->degree());
    }
    Gaussians all = scene::make_gaussians(0, degree);
    if (parts.size() > 1)
        for (const scene::Attribute& attribute : scene::attributes(degree))
            (all.*attribute.array).reserve(static_cast<std::size_t>(count) * attribute.each);
    for (const Part& part : parts) {
        SPLAT_ASSIGN(Gaussians g, decode(*part.primitive, degree, ignored));
        SPLAT_TRY(place(g, *part.placement));
        if (parts.size() == 1)
            all = std::move(g);
        else
            append(all, g);
    }
    all.drawn_as.by_distance = all.drawn_as.three_sigma = true;
    all.drawn_as.linear_colors = !parts.empty() && parts.front().primitive->linear_colors;
    return all;
}

Result<LoadedScene> read_document(Document& document, LoadReport report,
                                  const LoadOptions& options) {
    std::set<std::string> ignored;
    const JsonTree& json = document.json();
    SPLAT_ASSIGN(const bool quantized,
                 check_extensions(json, {is_of_gaussians, may_be_required}, ignored));
    SPLAT_ASSIGN(const std::vector<Placement> placed, placed_meshes(document, ignored));
    Primitives primitives(document, ignored, quantized);
    for (const Placement& placement : placed)  // all files are read before the budget is known
        SPLAT_TRY(primitives.of_mesh(placement.mesh).status());
    DecodeBudget budget(document.file_bytes(), options.limits);
    SPLAT_ASSIGN(const std::vector<Part> parts, parts_of(placed, primitives, options, budget));
    if (parts.empty() && !uses_extension(json))
        return unsupported("gltf: no mesh of the scene has %s; surfaces are not read", kExtension);
    SPLAT_ASSIGN(Gaussians gaussians, gather_parts(parts, ignored));
    ignore_the_rest(json, ignored);
    report.version = 2;
    report.ignored.insert(report.ignored.end(), ignored.begin(), ignored.end());
    return finish_load(std::move(gaussians), std::move(report), kFrame, options);
}

constexpr std::uint32_t kGlbVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

Result<bool> is_glb(Bytes file) {
    return as_text(file).starts_with("glTF");
}

}  // namespace

Result<Chunks> chunks_of(Bytes file, const LoadOptions& options, LoadReport& report) {
    Reader header(file, "glb");
    std::uint32_t magic = 0, version = 0, bytes = 0;
    SPLAT_TRY(header.read(magic, "magic"));
    SPLAT_TRY(header.read(version, "version"));
    SPLAT_TRY(header.read(bytes, "length"));
    if (version != kGlbVersion) return unsupported("glb: version %u, expected 2", version);
    if (bytes < header.position())
        return damaged("glb: a length of %u, expected that of the file", bytes);
    SPLAT_ASSIGN(const Bytes body, header.take(bytes - header.position(), "chunks"));
    if (header.left() > 0) {
        report.left_out = format("%zu bytes after the last chunk", header.left());
        if (!options.lenient)
            return damaged(
                "glb: %s, expected none: something was appended to the file; a lenient reader "
                "leaves them out",
                report.left_out.c_str());
    }
    Chunks chunks;
    Reader reader(body, "glb");
    while (reader.left() > 0) {
        std::uint32_t length = 0, type = 0;
        SPLAT_TRY(reader.read(length, "chunk length"));
        SPLAT_TRY(reader.read(type, "chunk type"));
        if (length % 4 != 0)
            return damaged("glb: a chunk of %u bytes, expected a multiple of 4", length);
        SPLAT_ASSIGN(const Bytes data, reader.take(length, "chunk"));
        if (!chunks.json && type != kJsonChunk)
            return damaged("glb: the first chunk has type 0x%08x, expected 0x%08x (JSON)", type,
                           kJsonChunk);
        if (!chunks.json)
            chunks.json = data;
        else if (type == kBinaryChunk && !chunks.binary)
            chunks.binary = data;
        else
            report.ignored.push_back(format("chunk of type 0x%08x", type));
    }
    if (chunks.json) return chunks;
    return damaged("glb: no chunk, expected one of JSON");
}

}  // namespace gltf

Result<LoadedScene> read_gltf(Bytes file, const LoadOptions& options) {
    if (as_text(file).starts_with("glTF"))
        return damaged("gltf: the file is a .glb (its first bytes are 'glTF'), expected JSON");
    SPLAT_ASSIGN(gltf::Document document,
                 gltf::Document::open(as_text(file), std::nullopt, options));
    return gltf::read_document(document, {}, options);
}

Result<LoadedScene> read_glb(Bytes file, const LoadOptions& options) {
    LoadReport report;
    SPLAT_ASSIGN(const gltf::Chunks chunks, gltf::chunks_of(file, options, report));
    SPLAT_ASSIGN(gltf::Document document,
                 gltf::Document::open(as_text(*chunks.json), chunks.binary, options));
    return gltf::read_document(document, std::move(report), options);
}

extern const SceneFormat kGltfFormat = {.id = 7,
                                        .name = "gltf",
                                        .extension = ".gltf",
                                        .holds = "KHR_gaussian_splatting, float32, as text",
                                        .read = read_gltf,
                                        .write = put_gltf,
                                        .frame = gltf::kFrame,
                                        .says = gltf::kSays,
                                        .always = gltf::kAlways};

extern const SceneFormat kGlbFormat = {.id = 8,
                                       .name = "glb",
                                       .extension = ".glb",
                                       .holds = "KHR_gaussian_splatting, float32",
                                       .mark = "'glTF'",
                                       .detect = gltf::is_glb,
                                       .read = read_glb,
                                       .write = put_glb,
                                       .frame = gltf::kFrame,
                                       .says = gltf::kSays,
                                       .always = gltf::kAlways};

}  // namespace splat::io
