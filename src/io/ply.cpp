#include "io/ply.h"

#include <algorithm>

#include "io/ply_compressed.h"
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

/// The target of one property: an array, and the place in each Gaussian's part of it.
struct Target {
    std::size_t column;
    std::vector<float>* values;
    std::size_t each;
    std::size_t place;
};

class VertexReader {
  public:
    VertexReader(const PlyElement& vertex, LoadReport& report) : vertex_(vertex), report_(report) {}

    /// The degree, from the number of f_rest properties.
    Status find_degree() {
        std::size_t count = 0;
        while (vertex_.find(numbered("f_rest_", count))) ++count;
        for (std::uint32_t degree = 0; degree <= kMaxFileDegree; ++degree)
            if (count == 3 * std::size_t{sh_coefficients(degree)} - 3) {
                file_degree_ = degree;
                return {};
            }
        return error(Code::kFormat,
                     "ply: %zu properties f_rest_*, expected 0, 9, 24 or 45 (SH degree 0 to 3)",
                     count);
    }

    /// Find every property; afterwards scatter() fills `to`.
    Status bind(Gaussians& to) {
        const std::uint32_t degree = to.sh_degree;
        const std::size_t each = std::size_t{sh_coefficients(degree)} * 3;
        constexpr const char* kAxes[] = {"x", "y", "z"};
        SPLAT_TRY(add("opacity", to.opacity_logits, 1, 0));
        for (std::size_t i = 0; i < 3; ++i) {
            SPLAT_TRY(add(kAxes[i], to.means, 3, i));
            SPLAT_TRY(add(numbered("scale_", i), to.log_scales, 3, i));
            SPLAT_TRY(add(numbered("f_dc_", i), to.sh, each, i));
        }
        for (std::size_t i = 0; i < 4; ++i) SPLAT_TRY(add(numbered("rot_", i), to.rotations, 4, i));
        const std::size_t file_rest = sh_coefficients(file_degree_) - 1;
        for (std::size_t channel = 0; channel < 3; ++channel)
            for (std::size_t k = 1; k < sh_coefficients(degree); ++k)
                SPLAT_TRY(add(numbered("f_rest_", channel * file_rest + k - 1), to.sh, each,
                              k * 3 + channel));
        report_unused();
        return {};
    }

    void scatter(std::size_t row, const std::vector<double>& values) const {
        for (const Target& target : targets_)
            (*target.values)[row * target.each + target.place] =
                static_cast<float>(values[target.column]);
    }

    [[nodiscard]] std::uint32_t degree() const {
        return std::min(file_degree_, scene::kMaxShDegree);
    }

  private:
    Status add(const std::string& name, std::vector<float>& values, std::size_t each,
               std::size_t place) {
        const auto column = vertex_.find(name);
        if (!column || vertex_.properties[*column].list_count)
            return error(
                Code::kFormat,
                "ply: element 'vertex' has no number '%s'; expected the properties of a 3DGS "
                "file: x y z f_dc_0..2 opacity scale_0..2 rot_0..3. Is it a mesh or a point "
                "cloud?",
                name.c_str());
        targets_.push_back({*column, &values, each, place});
        return {};
    }

    void report_unused() {
        for (std::size_t i = 0; i < vertex_.properties.size(); ++i) {
            const std::string& name = vertex_.properties[i].name;
            const bool used = std::any_of(targets_.begin(), targets_.end(),
                                          [i](const Target& target) { return target.column == i; });
            const bool rest = name.starts_with("f_rest_") && file_degree_ > scene::kMaxShDegree;
            if (!used && !rest && name != "nx" && name != "ny" && name != "nz")
                report_.ignored.push_back("vertex." + name);
        }
        if (file_degree_ > scene::kMaxShDegree)
            report_.ignored.push_back("SH bands " + std::to_string(scene::kMaxShDegree + 1) +
                                      " to " + std::to_string(file_degree_));
    }

    const PlyElement& vertex_;
    LoadReport& report_;
    std::uint32_t file_degree_ = 0;
    std::vector<Target> targets_;
};

Result<Gaussians> read_vertices(const PlyElement& vertex, PlyRows& rows, LoadReport& report,
                                const LoadOptions& options, DecodeBudget& budget) {
    VertexReader reader(vertex, report);
    SPLAT_TRY(reader.find_degree());
    Gaussians gaussians;
    gaussians.sh_degree = reader.degree();
    SPLAT_TRY(reader.bind(gaussians));
    SPLAT_TRY(rows.need(vertex));
    SPLAT_TRY(check_count(vertex.count, reader.degree(), options, budget, "ply"));
    gaussians = scene::make_gaussians(vertex.count, reader.degree());
    SPLAT_TRY(rows.read(vertex, [&reader](std::size_t row, const std::vector<double>& values) {
        reader.scatter(row, values);
    }));
    return gaussians;
}

std::string header_text(std::size_t count, std::uint32_t degree) {
    std::string text =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) + "\n";
    const auto property = [&text](const std::string& name) {
        text += "property float " + name + "\n";
    };
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) property(name);
    for (std::size_t i = 0; i < 3; ++i) property(numbered("f_dc_", i));
    for (std::size_t i = 0; i < 3 * std::size_t{sh_coefficients(degree)} - 3; ++i)
        property(numbered("f_rest_", i));
    property("opacity");
    for (std::size_t i = 0; i < 3; ++i) property(numbered("scale_", i));
    for (std::size_t i = 0; i < 4; ++i) property(numbered("rot_", i));
    return text + "end_header\n";
}

void put_vertex(Buffer& to, const Gaussians& g, std::size_t i) {
    const std::size_t count = sh_coefficients(g.sh_degree);
    const float* const sh = g.sh.data() + i * count * 3;
    for (std::size_t k = 0; k < 3; ++k) put(to, g.means[i * 3 + k]);
    for (std::size_t k = 0; k < 3; ++k) put(to, 0.0F);
    for (std::size_t channel = 0; channel < 3; ++channel) put(to, sh[channel]);
    for (std::size_t channel = 0; channel < 3; ++channel)
        for (std::size_t k = 1; k < count; ++k) put(to, sh[k * 3 + channel]);
    put(to, g.opacity_logits[i]);
    for (std::size_t k = 0; k < 3; ++k) put(to, g.log_scales[i * 3 + k]);
    for (std::size_t k = 0; k < 4; ++k) put(to, g.rotations[i * 4 + k]);
}

}  // namespace

Result<bool> is_plain_ply(Bytes file) {
    if (!is_ply(file)) return false;
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    return !has_packed_chunks(header);
}

Result<LoadedScene> read_ply(Bytes file, const LoadOptions& options) {
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    if (header.find("vertex") == nullptr)
        return error(Code::kFormat, "ply: there is no element 'vertex'");
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
    const std::string header = header_text(scene.count(), scene.sh_degree);
    Buffer file;
    file.reserve(header.size() + scene.count() *
                                     (14 + 3 * std::size_t{sh_coefficients(scene.sh_degree)}) *
                                     sizeof(float));
    put_text(file, header);
    std::size_t bad = 0;
    for (std::size_t i = 0; i < scene.count(); ++i) {
        put_vertex(file, scene, i);
        bad += holds_numbers(scene, i) ? 0 : 1;
    }
    warn_of_loss("ply", bad, scene.count(),
                 "Gaussians have a value that is not finite, and keep it");
    return file;
}

}  // namespace splat::io
