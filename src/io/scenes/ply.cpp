#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <algorithm>

#include "core/log.h"
#include "core/shown.h"
#include "io/ply_rows.h"
#include "scene/arrays.h"

namespace splat::io {
namespace {

using scene::Gaussians;
using scene::sh_coefficients;

constexpr std::uint32_t kMaxFileDegree = 10;
constexpr const char* kColorSpace = "color_space";  ///< element and property

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
            report.ignored.push_back("vertex." + shown(property.name, 80));
    }
    if (more_bands) report.ignored.push_back(dropped_bands(file_degree));
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
    SPLAT_TRY(rows.need(vertex));
    SPLAT_TRY(check_count(vertex.count, degree, options, budget, "ply"));
    Gaussians gaussians =  // at least one: of none, arrays have no address
        scene::reserve_gaussians(std::max<std::size_t>(vertex.count, 1), degree);
    struct Target {
        std::size_t column;
        float* to;
        std::size_t each;
    };
    std::vector<Target> targets;
    for (const VertexField& field : fields) {
        const auto column = vertex.find(field.name);
        if (!column || vertex.properties[*column].list_count)
            return damaged(
                "ply: element 'vertex' has no number '%s'; expected the properties of a 3DGS "
                "file: x y z f_dc_0..2 opacity scale_0..2 rot_0..3. Is it %s?",
                field.name.c_str(),
                field.name == "scale_2" ? "of 2D Gaussians" : "a mesh or a point cloud");
        targets.push_back({*column, (gaussians.*field.values).data() + field.place, field.each});
    }
    SPLAT_TRY(rows.read(vertex, [&](std::size_t row, const std::vector<double>& values) {
        if (row % kSceneBlock == 0)
            scene::resize(gaussians, std::min<std::size_t>(row + kSceneBlock, vertex.count));
        for (const Target& target : targets)
            target.to[row * target.each] = static_cast<float>(values[target.column]);
    }));
    return gaussians;
}

/// SHARP's element of one number: 0 for colours of sRGB, which scenes hold anyway, 1 for linear ones.
Status read_color_space(const PlyElement& element, PlyRows& rows, LoadReport& report,
                        bool& linear) {
    const bool known = element.count == 1 && element.properties.size() == 1 &&
                       element.properties[0].name == kColorSpace &&
                       !element.properties[0].list_count;
    if (!known) {
        report.ignored.push_back("element " + shown(element.name, 80));
        return rows.skip(element);
    }
    return rows.read(element, [&](std::size_t, const std::vector<double>& values) {
        linear = values[0] == 1;
        if (values[0] != 0 && values[0] != 1)
            report.ignored.push_back(format("element %s of value %g", kColorSpace, values[0]));
    });
}

}  // namespace

bool antialiased_ply(const PlyHeader& header, LoadReport& report) {
    bool antialiased = false;
    for (const std::string& comment : header.comments) {
        const std::size_t blank = std::min(comment.find(' '), comment.size());
        const std::string key = comment.substr(0, blank);
        const std::size_t start = std::min(comment.find_first_not_of(' ', blank), comment.size());
        const std::string value = comment.substr(start);
        if (key == "antialiased" && (value == "0" || value == "1")) antialiased = value == "1";
        if (key != "SplatRenderMode:") continue;
        antialiased = value == "mip";
        if (antialiased || value == "default") continue;
        report.ignored.push_back("SplatRenderMode: " + shown(value, 40));
        if (value == "2dgs")
            log(LogLevel::kWarning,
                "ply: the header says SplatRenderMode: 2dgs. Its Gaussians are flat, and drawn as "
                "3D ones, not where the rays meet their planes");
    }
    return antialiased;
}

Result<bool> is_plain_ply(Bytes file) {
    SPLAT_ASSIGN(const bool compressed, is_compressed_ply(file));
    return is_ply(file) && !compressed;
}

Result<LoadedScene> read_ply(Bytes file, const LoadOptions& options) {
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    if (header.find("vertex") == nullptr) return damaged("ply: there is no element 'vertex'");
    PlyRows rows(header, file, options.discard);
    DecodeBudget budget(file.size(), options.limits);
    Gaussians gaussians;
    LoadReport report;
    bool linear = false;
    for (const PlyElement& element : header.elements) {
        if (element.name == "vertex") {
            SPLAT_ASSIGN(gaussians, read_vertices(element, rows, report, options, budget));
        } else if (element.name == kColorSpace) {
            SPLAT_TRY(read_color_space(element, rows, report, linear));
        } else {
            SPLAT_TRY(rows.skip(element));
            report.ignored.push_back("element " + shown(element.name, 80));
        }
    }
    gaussians.drawn_as.linear_colors = linear;
    gaussians.drawn_as.antialiased = antialiased_ply(header, report);
    SPLAT_ASSIGN(report.left_out, rows.rest(options.lenient));
    return finish_load(std::move(gaussians), std::move(report), scene::Frame::kRdf, options);
}

Status put_ply(const Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    const std::uint32_t degree = options.sh_degree.value_or(gaussians.sh_degree);
    SPLAT_TRY(check_save(gaussians, options));
    const std::vector<VertexField> fields = vertex_fields(degree, degree);
    const scene::DrawnAs& drawn_as = gaussians.drawn_as;
    std::string header = "ply\nformat binary_little_endian 1.0\n";
    if (drawn_as.antialiased) header += kAntialiasedPly;
    header += "element vertex " + std::to_string(gaussians.count()) + "\n";
    for (const VertexField& field : fields) header += "property float " + field.name + "\n";
    if (drawn_as.linear_colors)
        header += format("element %s 1\nproperty uchar %s\n", kColorSpace, kColorSpace);
    header += "end_header\n";
    SPLAT_TRY(to.put(as_bytes(header)));
    std::size_t bad = 0;
    std::vector<float> rows;
    const auto put_block = [&](const Gaussians& block, std::size_t) {
        rows.assign(block.count() * fields.size(), 0);
        for (std::size_t k = 0; k < fields.size(); ++k) {
            const auto& [name, values, each, place] = fields[k];
            if (values == nullptr) continue;
            const float* from = (block.*values).data() + place;
            for (std::size_t i = k; i < rows.size(); i += fields.size(), from += each)
                rows[i] = *from;
        }
        for (std::size_t i = 0; i < block.count(); ++i) bad += holds_numbers(block, i) ? 0 : 1;
        return to.put(std::as_bytes(std::span(rows)));
    };
    SPLAT_TRY(for_saved_blocks(gaussians, scene::Frame::kRdf, options, put_block));
    if (drawn_as.linear_colors) SPLAT_TRY(to.put(as_bytes("\x01")));
    warn_of_loss("ply", bad, gaussians.count(),
                 "Gaussians have a value that is not finite, and keep it");
    return {};
}

extern const SceneFormat kPlyFormat = {.id = 1,
                                       .name = "ply",
                                       .extension = ".ply",
                                       .holds = "all of a scene, as 3DGS writes it",
                                       .mark = "the line 'ply'",
                                       .detect = is_plain_ply,
                                       .read = read_ply,
                                       .write = put_ply,
                                       .says = {.antialiased = true, .linear_colors = true}};

}  // namespace splat::io
