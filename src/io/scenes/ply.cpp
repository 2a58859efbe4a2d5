#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <algorithm>

#include "io/ply_rows.h"
#include "scene/arrays.h"

namespace splat::io {
namespace {

using scene::Gaussians;
using scene::sh_coefficients;

constexpr std::uint32_t kMaxFileDegree = 10;

std::string numbered(const char* prefix, std::size_t index) {
    return prefix + std::to_string(index);
}

/// A property of element "vertex", and its place in each Gaussian's part of an array; null: a normal, which is 0.
struct VertexField {
    std::string name;
    std::vector<float> Gaussians::*values;
    std::size_t each;
    std::size_t place;
};

/// In the order of a 3DGS file of degree `file_degree`, without the bands above `degree`.
std::vector<VertexField> vertex_fields(std::uint32_t degree, std::uint32_t file_degree) {
    const std::size_t count = sh_coefficients(degree);
    const std::size_t file_rest = sh_coefficients(file_degree) - 1;
    std::vector<VertexField> fields;
    for (std::size_t i = 0; i < 3; ++i)
        fields.push_back({std::string(1, "xyz"[i]), &Gaussians::means, 3, i});
    for (std::size_t i = 0; i < 3; ++i)
        fields.push_back({std::string("n") + "xyz"[i], nullptr, 0, 0});
    for (std::size_t i = 0; i < 3; ++i)
        fields.push_back({numbered("f_dc_", i), &Gaussians::sh, 3 * count, i});
    for (std::size_t channel = 0; channel < 3; ++channel)
        for (std::size_t k = 1; k < count; ++k)
            fields.push_back({numbered("f_rest_", channel * file_rest + k - 1), &Gaussians::sh,
                              3 * count, k * 3 + channel});
    fields.push_back({"opacity", &Gaussians::opacity_logits, 1, 0});
    for (std::size_t i = 0; i < 3; ++i)
        fields.push_back({numbered("scale_", i), &Gaussians::log_scales, 3, i});
    for (std::size_t i = 0; i < 4; ++i)
        fields.push_back({numbered("rot_", i), &Gaussians::rotations, 4, i});
    return fields;
}

/// The degree, from the number of f_rest properties.
Result<std::uint32_t> degree_of(const PlyElement& vertex) {
    std::size_t count = 0;
    while (vertex.find(numbered("f_rest_", count))) ++count;
    for (std::uint32_t degree = 0; degree <= kMaxFileDegree; ++degree)
        if (count == 3 * std::size_t{sh_coefficients(degree)} - 3) return degree;
    return damaged("ply: %zu properties f_rest_*, expected 0, 9, 24 or 45 (SH degree 0 to 3)",
                   count);
}

void report_unused(const PlyElement& vertex, const std::vector<VertexField>& fields,
                   std::uint32_t file_degree, LoadReport& report) {
    const bool more_bands = file_degree > scene::kMaxShDegree;
    for (const PlyProperty& property : vertex.properties) {
        const bool used = std::ranges::any_of(
            fields, [&](const VertexField& field) { return field.name == property.name; });
        if (!used && !(more_bands && property.name.starts_with("f_rest_")))
            report.ignored.push_back("vertex." + property.name);
    }
    if (more_bands)
        report.ignored.push_back("SH bands " + std::to_string(scene::kMaxShDegree + 1) + " to " +
                                 std::to_string(file_degree));
}

Result<Gaussians> read_vertices(const PlyElement& vertex, PlyRows& rows, LoadReport& report,
                                const LoadOptions& options, DecodeBudget& budget) {
    SPLAT_ASSIGN(const std::uint32_t file_degree, degree_of(vertex));
    const std::uint32_t degree = std::min(file_degree, scene::kMaxShDegree);
    std::vector<VertexField> fields = vertex_fields(degree, file_degree);
    report_unused(vertex, fields, file_degree, report);
    std::erase_if(fields, [](const VertexField& field) { return field.values == nullptr; });
    // The message names what tells scenes from meshes and point clouds.
    // No ranges::stable_partition: clang 14 does not compile the subrange of libstdc++ 12 that it returns.
    std::stable_partition(fields.begin(), fields.end(),
                          [](const VertexField& field) { return field.name == "opacity"; });
    std::vector<std::size_t> columns;
    for (const VertexField& field : fields) {
        const auto column = vertex.find(field.name);
        if (!column || vertex.properties[*column].list_count)
            return damaged(
                "ply: element 'vertex' has no number '%s'; expected the properties of a 3DGS "
                "file: x y z f_dc_0..2 opacity scale_0..2 rot_0..3. Is it a mesh or a point "
                "cloud?",
                field.name.c_str());
        columns.push_back(*column);
    }
    SPLAT_TRY(rows.need(vertex));
    SPLAT_TRY(check_count(vertex.count, degree, options, budget, "ply"));
    Gaussians gaussians = scene::make_gaussians(vertex.count, degree);
    SPLAT_TRY(rows.read(vertex, [&](std::size_t row, const std::vector<double>& values) {
        for (std::size_t i = 0; i < fields.size(); ++i)
            (gaussians.*fields[i].values)[row * fields[i].each + fields[i].place] =
                static_cast<float>(values[columns[i]]);
    }));
    return gaussians;
}

}  // namespace

Result<bool> is_plain_ply(Bytes file) {
    SPLAT_ASSIGN(const bool compressed, is_compressed_ply(file));
    return is_ply(file) && !compressed;
}

Result<LoadedScene> read_ply(Bytes file, const LoadOptions& options) {
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    if (header.find("vertex") == nullptr) return damaged("ply: there is no element 'vertex'");
    PlyRows rows(header, file);
    DecodeBudget budget(file.size(), options.limits);
    Gaussians gaussians;
    LoadReport report;
    for (const PlyElement& element : header.elements) {
        if (element.name == "vertex") {
            SPLAT_ASSIGN(gaussians, read_vertices(element, rows, report, options, budget));
        } else {
            SPLAT_TRY(rows.skip(element));
        }
    }
    for (const PlyElement& element : header.elements)
        if (element.name != "vertex") report.ignored.push_back("element " + element.name);
    SPLAT_ASSIGN(report.left_out, rows.rest(options.lenient));
    return finish_load(std::move(gaussians), std::move(report), scene::Frame::kRdf, options);
}

Result<Buffer> write_ply(const Gaussians& gaussians, const SaveOptions& options) {
    SPLAT_ASSIGN(const Gaussians scene, prepare_save(gaussians, scene::Frame::kRdf, options));
    const std::vector<VertexField> fields = vertex_fields(scene.sh_degree, scene.sh_degree);
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                         std::to_string(scene.count()) + "\n";
    for (const VertexField& field : fields) header += "property float " + field.name + "\n";
    header += "end_header\n";
    Buffer file;
    file.reserve(header.size() + scene.count() * fields.size() * sizeof(float));
    put_text(file, header);
    std::size_t bad = 0;
    for (std::size_t i = 0; i < scene.count(); ++i) {
        for (const VertexField& field : fields)
            put(file, field.values == nullptr
                          ? 0.0F
                          : (scene.*field.values)[i * field.each + field.place]);
        bad += holds_numbers(scene, i) ? 0 : 1;
    }
    warn_of_loss("ply", bad, scene.count(),
                 "Gaussians have a value that is not finite, and keep it");
    return file;
}

extern const SceneFormat kPlyFormat = {.id = 1,
                                       .name = "ply",
                                       .extension = ".ply",
                                       .holds = "all of a scene, as 3DGS writes it",
                                       .mark = "the line 'ply'",
                                       .detect = is_plain_ply,
                                       .read = read_ply,
                                       .write = write_ply};

}  // namespace splat::io
