// Writing: one mesh of points with KHR_gaussian_splatting, as a .glb or with a data URI.

#include <algorithm>
#include <cmath>

#include "core/checked_math.h"
#include "core/json_writer.h"
#include "io/scene_formats.h"
#include "io/scenes/gltf.h"
#include "scene/arrays.h"
#include "scene/sh.h"
#include "scene/srgb.h"

namespace splat::io {
namespace gltf {
namespace {

using scene::Gaussians;

constexpr std::uint32_t kUnsignedShort = 5123, kFloat32 = 5126;

/// An array of the file: how it is named, and its bytes of Gaussian i.
struct Array {
    std::string attribute;
    const char* type;
    std::uint32_t component;
    std::size_t bytes_each;
    void (*put)(Buffer& to, const Gaussians& g, std::size_t i, std::size_t coefficient);
    std::size_t coefficient = 0;  ///< which one, of harmonics
};

void put_position(Buffer& to, const Gaussians& g, std::size_t i, std::size_t) {
    for (std::size_t k = 0; k < 3; ++k) put(to, g.means[3 * i + k]);
}

/// What a program shows that draws points: the constant colour, linear as glTF has it, and the opacity.
void put_color(Buffer& to, const Gaussians& g, std::size_t i, std::size_t) {
    const auto put_short = [&to](double value) {
        put(to, static_cast<std::uint16_t>(std::lround(65535 * value)));
    };
    const float* const sh = &g.sh[i * scene::sh_coefficients(g.sh_degree) * 3];
    for (std::size_t k = 0; k < 3; ++k) {
        const auto color = static_cast<float>(
            std::clamp(0.5 + scene::kSh0 * static_cast<double>(sh[k]), 0.0, 1.0));
        put_short(
            static_cast<double>(g.drawn_as.linear_colors ? color : scene::linear_of_srgb(color)));
    }
    put_short(scene::opacity_of(static_cast<double>(g.opacity_logits[i])));
}

void put_rotation(Buffer& to, const Gaussians& g, std::size_t i, std::size_t) {
    for (const std::size_t k : {1U, 2U, 3U, 0U}) put(to, g.rotations[4 * i + k]);
}

void put_scale(Buffer& to, const Gaussians& g, std::size_t i, std::size_t) {
    for (std::size_t k = 0; k < 3; ++k)
        put(to, static_cast<float>(std::exp(static_cast<double>(g.log_scales[3 * i + k]))));
}

void put_opacity(Buffer& to, const Gaussians& g, std::size_t i, std::size_t) {
    put(to, static_cast<float>(scene::opacity_of(static_cast<double>(g.opacity_logits[i]))));
}

void put_harmonic(Buffer& to, const Gaussians& g, std::size_t i, std::size_t coefficient) {
    const std::size_t each = scene::sh_coefficients(g.sh_degree);
    for (std::size_t k = 0; k < 3; ++k) put(to, g.sh[(i * each + coefficient) * 3 + k]);
}

/// Each of a multiple of 4 bytes, so that all are aligned.
std::vector<Array> arrays_of(const Gaussians& g) {
    const std::string own = std::string(kExtension) + ":";
    std::vector<Array> arrays = {{"POSITION", "VEC3", kFloat32, 12, put_position},
                                 {"COLOR_0", "VEC4", kUnsignedShort, 8, put_color},
                                 {own + "ROTATION", "VEC4", kFloat32, 16, put_rotation},
                                 {own + "SCALE", "VEC3", kFloat32, 12, put_scale},
                                 {own + "OPACITY", "SCALAR", kFloat32, 4, put_opacity}};
    for (std::size_t degree = 0; degree <= g.sh_degree; ++degree)
        for (std::size_t order = 0; order < 2 * degree + 1; ++order)
            arrays.push_back({own + format("SH_DEGREE_%zu_COEF_%zu", degree, order), "VEC3",
                              kFloat32, 12, put_harmonic, degree * degree + order});
    return arrays;
}

std::uint64_t bytes_of(const std::vector<Array>& arrays, std::size_t count) {
    std::uint64_t bytes = 0;
    for (const Array& array : arrays) bytes += array.bytes_each * count;
    return bytes;
}

/// Refuses Gaussians that the format cannot hold. A rotation of length 0 becomes none: files hold unit quaternions.
Status check_values(Gaussians& g) {
    for (std::size_t i = 0; i < g.count(); ++i) {
        const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
        if (!all_finite(g.means, i, 3) || !all_finite(g.rotations, i, 4) ||
            !all_finite(g.sh, i, each) || std::isnan(g.opacity_logits[i]))
            return invalid(
                "gltf: Gaussian %zu has a value that is not finite, which the format cannot hold; "
                "remove it, or write .ply",
                i);
        for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
            if (std::isnan(g.log_scales[k]) || g.log_scales[k] == INFINITY ||
                loses_scale(g.log_scales[k]))
                return invalid(
                    "gltf: Gaussian %zu has a log scale of %g, whose exponential float32 cannot "
                    "hold, expected about -103 to 88; remove it, or write .ply",
                    i, static_cast<double>(g.log_scales[k]));
    }
    warn_of_loss("gltf", scene::normalise_rotations(g), g.count(),
                 "rotations have length 0, and are written as none");
    for (std::size_t i = 0; i < g.rotations.size(); i += 4)
        if (std::all_of(&g.rotations[i], &g.rotations[i] + 4, [](float v) { return v == 0; }))
            g.rotations[i] = 1;
    return {};
}

void describe_arrays(JsonWriter& json, const Gaussians& g, const std::vector<Array>& arrays) {
    constexpr int kArrayBuffer = 34962;  // target of attributes
    json.key("bufferViews").begin_array();
    std::uint64_t offset = 0;
    for (const Array& array : arrays) {
        const std::uint64_t bytes = array.bytes_each * g.count();
        json.begin_object().member("buffer", 0).member("byteOffset", offset);
        json.member("byteLength", bytes).member("target", kArrayBuffer).end();
        offset += bytes;
    }
    json.end().key("accessors").begin_array();
    for (std::size_t i = 0; i < arrays.size(); ++i) {
        json.begin_object().member("bufferView", i).member("componentType", arrays[i].component);
        json.member("count", g.count()).member("type", arrays[i].type);
        if (arrays[i].component == kUnsignedShort) json.member("normalized", true);
        if (arrays[i].attribute == "POSITION") {
            std::vector<double> low(3, HUGE_VAL), high(3, -HUGE_VAL);
            for (std::size_t k = 0; k < g.means.size(); ++k) {
                low[k % 3] = std::min(low[k % 3], static_cast<double>(g.means[k]));
                high[k % 3] = std::max(high[k % 3], static_cast<double>(g.means[k]));
            }
            json.key("min").list(low).key("max").list(high);
        }
        json.end();
    }
    json.end();
}

/// The document. `uri`: of its buffer; null for that of a .glb. The extension is used, not required: programs without
/// it show points, and its text asks for more only where another one builds on it. An accessor has at least one
/// element, so a scene without Gaussians has no mesh.
std::string document_of(const Gaussians& g, const std::vector<Array>& arrays, const char* uri) {
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object().key("asset").begin_object();
    json.member("version", "2.0").member("generator", "libsplat").end();
    json.key("extensionsUsed").list(std::vector<std::string>{kExtension}).member("scene", 0);
    json.key("scenes").begin_array().begin_object();
    if (g.count() == 0) return json.end().end().end().text();
    json.key("nodes").list(std::vector<int>{0}).end().end();
    json.key("nodes").begin_array().begin_object().member("mesh", 0).end().end();
    json.key("meshes").begin_array().begin_object().key("primitives").begin_array();
    json.begin_object().key("attributes").begin_object();
    for (std::size_t i = 0; i < arrays.size(); ++i) json.member(arrays[i].attribute, i);
    json.end().member("mode", 0).key("extensions").begin_object();
    json.key(kExtension).begin_object().member("kernel", "ellipse");
    json.member("colorSpace",
                g.drawn_as.linear_colors ? "lin_rec709_display" : "srgb_rec709_display");
    json.member("projection", "perspective").member("sortingMethod", "cameraDistance");
    json.end().end().end().end().end().end();
    json.key("buffers").begin_array().begin_object();
    json.member("byteLength", bytes_of(arrays, g.count()));
    if (uri != nullptr) json.member("uri", uri);
    json.end().end();
    describe_arrays(json, g, arrays);
    return json.end().text();
}

/// All arrays, one after the other, as their buffer views have them.
Status put_arrays(ByteSink& to, const Gaussians& g, const std::vector<Array>& arrays) {
    for (const Array& array : arrays) {
        Buffer bytes;
        bytes.reserve(array.bytes_each * g.count());
        for (std::size_t i = 0; i < g.count(); ++i) array.put(bytes, g, i, array.coefficient);
        SPLAT_TRY(to.put(bytes));
    }
    return {};
}

Result<Gaussians> prepare(const Gaussians& gaussians, const SaveOptions& options) {
    SPLAT_ASSIGN(Gaussians scene, prepare_save(gaussians, kFrame, options));
    SPLAT_TRY(check_values(scene));
    return scene;
}

}  // namespace

Status check_glb_size(std::uint64_t json_bytes, std::uint64_t binary_bytes) {
    constexpr std::uint64_t kHeaders = 12 + 8 + 8;
    if (json_bytes + binary_bytes <= UINT32_MAX - kHeaders) return {};
    return unsupported(
        "glb: %llu bytes, the format counts them in 32 bits; write fewer harmonics (sh_degree), "
        ".spz or .ply",
        llu(json_bytes + binary_bytes + kHeaders));
}

}  // namespace gltf

Status put_gltf(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    SPLAT_ASSIGN(const scene::Gaussians scene, gltf::prepare(gaussians, options));
    constexpr std::string_view kUri = "data:application/octet-stream;base64,";
    const auto arrays = gltf::arrays_of(scene);
    const std::string json = gltf::document_of(scene, arrays, kUri.data());
    BufferSink binary;
    binary.file.reserve(gltf::bytes_of(arrays, scene.count()));
    SPLAT_TRY(gltf::put_arrays(binary, scene, arrays));
    Buffer text;
    gltf::put_base64(text, binary.file);
    const std::size_t data = std::min(json.find(kUri), json.size() - kUri.size()) + kUri.size();
    SPLAT_TRY(to.put(as_bytes(std::string_view(json).substr(0, data))));
    SPLAT_TRY(to.put(text));
    return to.put(as_bytes(std::string_view(json).substr(data)));
}

Status put_glb(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    SPLAT_ASSIGN(const scene::Gaussians scene, gltf::prepare(gaussians, options));
    const auto arrays = gltf::arrays_of(scene);
    std::string json = gltf::document_of(scene, arrays, nullptr);
    json.resize(round_up(json.size(), 4), ' ');
    const std::uint64_t binary = gltf::bytes_of(arrays, scene.count());
    SPLAT_TRY(gltf::check_glb_size(json.size(), binary));
    const std::uint64_t bytes = 12 + 8 + json.size() + (binary == 0 ? 0 : 8 + binary);
    Buffer head;
    put_text(head, "glTF");
    for (const std::uint64_t word : {std::uint64_t{2}, bytes, std::uint64_t{json.size()}})
        put(head, static_cast<std::uint32_t>(word));
    put_text(head, "JSON");
    put_text(head, json);
    if (binary > 0) {
        put(head, static_cast<std::uint32_t>(binary));
        put_text(head, std::string_view("BIN\0", 4));
    }
    SPLAT_TRY(to.put(head));
    return gltf::put_arrays(to, scene, arrays);
}

}  // namespace splat::io
