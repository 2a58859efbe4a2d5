// Materials of glTF: base colours and their textures. What depends on light is left out.

#include <cmath>

#include "core/shown.h"
#include "io/mesh/gltf_surface.h"
#include "io/reader.h"

namespace splat::io::gltf {
namespace {

constexpr const char* kSpecularGlossiness = "KHR_materials_pbrSpecularGlossiness";

/// Members of a material that say how light changes its colour.
constexpr const char* kOfLight[] = {"emissiveTexture", "emissiveFactor", "normalTexture",
                                    "occlusionTexture"};

Result<scene::Wrap> wrap_of(std::uint64_t code, const std::string& where) {
    if (code == 10497) return scene::Wrap::kRepeat;
    if (code == 33071) return scene::Wrap::kClamp;
    if (code == 33648) return scene::Wrap::kMirror;
    return damaged("gltf: %s: wrap %llu, expected 10497, 33071 or 33648", where.c_str(), llu(code));
}

/// uv' = move rotation scale uv, where a rotation turns coordinates against the clock.
Status read_transform(const JsonTree& json, const std::string& where, std::array<float, 6>& to) {
    double move[2] = {0, 0}, scale[2] = {1, 1};
    if (json.find("offset") != nullptr)
        SPLAT_TRY(read_numbers(json["offset"], move, 2, "offset", where));
    if (json.find("scale") != nullptr)
        SPLAT_TRY(read_numbers(json["scale"], scale, 2, "scale", where));
    double angle = 0;
    if (json.find("rotation") != nullptr) {
        angle = json["rotation"].number().value_or(NAN);
        if (!std::isfinite(angle))
            return damaged("gltf: %s: rotation is no finite number", where.c_str());
    }
    const double c = std::cos(angle), s = std::sin(angle);
    const double all[6] = {c * scale[0],  s * scale[1], move[0],
                           -s * scale[0], c * scale[1], move[1]};
    for (std::size_t i = 0; i < 6; ++i) {
        to[i] = static_cast<float>(all[i]);
        if (!std::isfinite(to[i]))
            return damaged("gltf: %s: a number beyond float32", where.c_str());
    }
    return {};
}

}  // namespace

Status SurfaceMaterials::read_alpha(const JsonTree& json, const std::string& where,
                                    scene::MeshMaterial& to) {
    const JsonTree& sides = json["doubleSided"];
    const bool* const both = std::get_if<bool>(&sides.value);
    if (both == nullptr && !sides.is_null())
        return damaged("gltf: %s: doubleSided is neither true nor false", where.c_str());
    to.double_sided = both != nullptr && *both;
    if (json.find("alphaMode") == nullptr) return {};
    const std::string* const mode = json["alphaMode"].text();
    const std::pair<const char*, scene::AlphaMode> modes[] = {{"OPAQUE", scene::AlphaMode::kOpaque},
                                                              {"MASK", scene::AlphaMode::kMask},
                                                              {"BLEND", scene::AlphaMode::kBlend}};
    bool known = false;
    for (const auto& [name, value] : modes)
        if (mode != nullptr && *mode == name) {
            to.alpha = value;
            known = true;
        }
    if (!known)
        return damaged("gltf: %s: alphaMode '%s', expected OPAQUE, MASK or BLEND", where.c_str(),
                       mode == nullptr ? "" : shown(*mode, 40).c_str());
    if (json.find("alphaCutoff") == nullptr) return {};
    const double cutoff = json["alphaCutoff"].number().value_or(NAN);
    if (!(cutoff >= 0 && cutoff <= 1e6))
        return damaged("gltf: %s: alphaCutoff is no number of 0 or more", where.c_str());
    to.alpha_cutoff = static_cast<float>(cutoff);
    return {};
}

Status SurfaceMaterials::read_sampler(const JsonTree& texture, const std::string& where,
                                      scene::MeshMaterial& to) {
    if (texture.find("sampler") == nullptr) return {};
    SPLAT_ASSIGN(const std::uint64_t index, whole_number(texture, "sampler", where));
    SPLAT_ASSIGN(const JsonTree* const sampler, document_.element("samplers", index));
    const std::string place = format("samplers[%llu]", llu(index));
    SPLAT_ASSIGN(const std::uint64_t u, whole_number(*sampler, "wrapS", place, 10497));
    SPLAT_ASSIGN(const std::uint64_t v, whole_number(*sampler, "wrapT", place, 10497));
    SPLAT_SET(to.wrap_u, wrap_of(u, place));
    SPLAT_SET(to.wrap_v, wrap_of(v, place));
    SPLAT_ASSIGN(const std::uint64_t filter, whole_number(*sampler, "magFilter", place, 9729));
    if (filter != 9728 && filter != 9729)
        return damaged("gltf: %s: magFilter %llu, expected 9728 or 9729", place.c_str(),
                       llu(filter));
    to.nearest = filter == 9728;
    return {};
}

Status SurfaceMaterials::read_texture(const JsonTree& info, const std::string& where,
                                      scene::MeshMaterial& to, Found& found) {
    SPLAT_ASSIGN(const std::uint64_t index, whole_number(info, "index", where));
    SPLAT_SET(found.texcoord_set, whole_number(info, "texCoord", where, 0));
    if (const JsonTree* const moved = info["extensions"].find("KHR_texture_transform")) {
        SPLAT_TRY(read_transform(*moved, where, to.at));
        SPLAT_SET(found.texcoord_set, whole_number(*moved, "texCoord", where, found.texcoord_set));
    }
    SPLAT_ASSIGN(const JsonTree* const texture, document_.element("textures", index));
    const std::string place = format("textures[%llu]", llu(index));
    SPLAT_TRY(read_sampler(*texture, place, to));
    const JsonTree* const webp = (*texture)["extensions"].find("EXT_texture_webp");
    const JsonTree& named = webp != nullptr && webp->find("source") != nullptr ? *webp : *texture;
    if (named.find("source") == nullptr) {
        const Status none = unsupported(
            "gltf: %s has no source, or one of an extension that is not read; expected an image of "
            "PNG, JPEG or WebP",
            place.c_str());
        if (!lenient_) return none;
        to_.ignored.insert(none.message());
        return {};
    }
    SPLAT_ASSIGN(const std::uint64_t source, whole_number(named, "source", place));
    SPLAT_SET(to.texture, textures_.add(
                              std::to_string(source), [&] { return document_.image(source); },
                              format("gltf: images[%llu]", llu(source)), to_));
    found.textured = to.texture != scene::kNone;
    return {};
}

Result<SurfaceMaterials::Found> SurfaceMaterials::read(const JsonTree& json,
                                                       const std::string& where) {
    Found found;
    scene::MeshMaterial material;
    SPLAT_TRY(read_alpha(json, where, material));
    const JsonTree* const glossy = json["extensions"].find(kSpecularGlossiness);
    const JsonTree& colors = glossy != nullptr ? *glossy : json["pbrMetallicRoughness"];
    const char* const factor = glossy != nullptr ? "diffuseFactor" : "baseColorFactor";
    const char* const texture = glossy != nullptr ? "diffuseTexture" : "baseColorTexture";
    if (colors.find(factor) != nullptr) {
        double values[4];
        SPLAT_TRY(read_numbers(colors[factor], values, 4, factor, where));
        for (std::size_t k = 0; k < 4; ++k) {
            if (!(values[k] >= 0 && values[k] <= 1))
                return damaged("gltf: %s: %s has %g, expected 0 to 1", where.c_str(), factor,
                               values[k]);
            material.color[k] = static_cast<float>(values[k]);
        }
    }
    if (const JsonTree* const info = colors.find(texture))
        SPLAT_TRY(read_texture(*info, where, material, found));
    for (const char* const member : kOfLight)
        if (json.find(member) != nullptr) to_.ignored.insert(std::string("material's ") + member);
    found.index = static_cast<std::uint32_t>(to_.mesh.materials.size());
    to_.mesh.materials.push_back(material);
    return found;
}

Result<SurfaceMaterials::Found> SurfaceMaterials::find(std::optional<std::uint64_t> index) {
    if (const auto known = known_.find(index); known != known_.end()) return known->second;
    const JsonTree none;
    const JsonTree* json = &none;
    if (index) SPLAT_SET(json, document_.element("materials", *index));
    SPLAT_ASSIGN(const Found found,
                 read(*json, index ? format("materials[%llu]", llu(*index)) : "a primitive"));
    return known_[index] = found;
}

}  // namespace splat::io::gltf
