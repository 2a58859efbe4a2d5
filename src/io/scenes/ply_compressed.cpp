#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/shown.h"
#include "io/bytes.h"
#include "io/ply_rows.h"
#include "scene/arrays.h"
#include "scene/select.h"
#include "scene/sh.h"

namespace splat::io {
namespace {

using scene::Gaussians;

constexpr std::size_t kChunkSize = 256;

constexpr const char* kRanges[] = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};
constexpr std::size_t kColorRanges = 12;  ///< index of min_r; the last six may be absent
constexpr const char* kWords[] = {"packed_position", "packed_rotation", "packed_scale",
                                  "packed_color"};

constexpr std::size_t kRestOfDegree[] = {0, 9, 24, 45};  ///< properties of element "sh"

using Chunk = std::array<double, std::size(kRanges)>;  ///< kRanges

struct Packed {
    std::vector<Chunk> chunks;
    std::vector<std::array<std::uint32_t, 4>> words;
    std::vector<std::uint8_t> rest;  ///< [n, rest_each] channel-major
    std::size_t rest_each = 0;
    std::uint32_t degree = 0;
    bool colored_chunks = false;
};

/// Where properties of these names are; notes the others.
Result<std::vector<std::size_t>> columns_of(const PlyElement& element,
                                            const std::vector<std::string>& names,
                                            LoadReport& report) {
    std::vector<std::size_t> columns;
    for (const std::string& name : names) {
        const auto column = element.find(name);
        if (!column || element.properties[*column].list_count)
            return damaged("compressed ply: element '%s' has no number '%s'", element.name.c_str(),
                           name.c_str());
        columns.push_back(*column);
    }
    for (const PlyProperty& property : element.properties)
        if (std::ranges::find(names, property.name) == names.end())
            report.ignored.push_back(element.name + "." + shown(property.name, 80));
    return columns;
}

Status read_chunks(const PlyElement& element, PlyRows& rows, Packed& packed, LoadReport& report) {
    packed.colored_chunks = element.find(kRanges[kColorRanges]).has_value();
    const std::size_t used = packed.colored_chunks ? std::size(kRanges) : kColorRanges;
    SPLAT_ASSIGN(const auto columns, columns_of(element, {kRanges, kRanges + used}, report));
    SPLAT_TRY(rows.need(element));
    packed.chunks.resize(element.count);
    return rows.read(element, [&](std::size_t row, const std::vector<double>& values) {
        for (std::size_t i = 0; i < used; ++i) packed.chunks[row][i] = values[columns[i]];
    });
}

Status read_words(const PlyElement& element, PlyRows& rows, Packed& packed, LoadReport& report) {
    SPLAT_ASSIGN(const auto columns,
                 columns_of(element, {std::begin(kWords), std::end(kWords)}, report));
    for (const std::size_t column : columns)
        if (element.properties[column].type != NumberType::kU32)
            return damaged("compressed ply: '%s' is not of type uint",
                           element.properties[column].name.c_str());
    SPLAT_TRY(rows.need(element));
    packed.words.resize(element.count);
    return rows.read(element, [&](std::size_t row, const std::vector<double>& values) {
        for (std::size_t i = 0; i < columns.size(); ++i)
            packed.words[row][i] =
                static_cast<std::uint32_t>(std::clamp(values[columns[i]], 0.0, 4294967295.0));
    });
}

Status read_rest(const PlyElement& element, PlyRows& rows, Packed& packed, LoadReport& report) {
    const std::size_t each = element.properties.size();
    const auto degree = std::ranges::find(kRestOfDegree, each);
    if (degree == std::end(kRestOfDegree) || each == 0)
        return damaged("compressed ply: element 'sh' has %zu properties, expected 9, 24 or 45",
                       each);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < each; ++i) names.push_back("f_rest_" + std::to_string(i));
    SPLAT_ASSIGN(const auto columns, columns_of(element, names, report));
    SPLAT_TRY(rows.need(element));
    packed.rest_each = each;
    packed.degree = static_cast<std::uint32_t>(degree - std::begin(kRestOfDegree));
    packed.rest.resize(element.count * each);
    return rows.read(element, [&](std::size_t row, const std::vector<double>& values) {
        for (std::size_t i = 0; i < each; ++i)
            packed.rest[row * each + i] = to_byte(values[columns[i]]);
    });
}

Status check_complete(const Packed& packed) {
    const std::size_t count = packed.words.size();
    const std::size_t chunks = static_cast<std::size_t>(ceil_div(count, kChunkSize));
    if (packed.chunks.size() < chunks)
        return damaged("compressed ply: %zu chunks for %zu Gaussians, expected %zu",
                       packed.chunks.size(), count, chunks);
    if (packed.rest_each != 0 && packed.rest.size() != count * packed.rest_each)
        return damaged(
            "compressed ply: element 'sh' has %zu rows, expected one for each of %zu Gaussians",
            packed.rest.size() / packed.rest_each, count);
    return {};
}

/// Bits first .. first + count - 1 as a fraction of their largest value.
double fraction(std::uint32_t word, unsigned first, unsigned count) {
    const std::uint32_t mask = (1U << count) - 1;
    return static_cast<double>((word >> first) & mask) / mask;
}

double mix(double low, double high, double t) {
    return low * (1 - t) + high * t;
}

/// x in 11 bits, y in 10, z in 11.
std::array<double, 3> fractions_11_10_11(std::uint32_t word) {
    return {fraction(word, 21, 11), fraction(word, 11, 10), fraction(word, 0, 11)};
}

/// Index of the largest component in the top bits, the other three in 10 bits each.
void decode_rotation(std::uint32_t word, float* wxyz) {
    std::array<double, 3> small{};
    double squared = 0;
    for (unsigned k = 0; k < 3; ++k) {
        small[k] = (fraction(word, 20 - 10 * k, 10) - 0.5) * std::sqrt(2.0);
        squared += small[k] * small[k];
    }
    const std::size_t largest = word >> 30U;
    std::size_t next = 0;
    for (std::size_t i = 0; i < 4; ++i)
        wxyz[i] = static_cast<float>(i == largest ? std::sqrt(std::max(0.0, 1 - squared))
                                                  : small[next++]);
}

void decode_gaussian(const Packed& packed, std::size_t i, Gaussians& g) {
    const auto& range = packed.chunks[i / kChunkSize];
    const auto [position, rotation, scale, color] = packed.words[i];
    const auto p = fractions_11_10_11(position);
    const auto s = fractions_11_10_11(scale);
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    for (std::size_t k = 0; k < 3; ++k) {
        g.means[i * 3 + k] = static_cast<float>(mix(range[k], range[3 + k], p[k]));
        g.log_scales[i * 3 + k] = static_cast<float>(mix(range[6 + k], range[9 + k], s[k]));
        double c = fraction(color, static_cast<unsigned>(24 - 8 * k), 8);
        if (packed.colored_chunks) c = mix(range[kColorRanges + k], range[kColorRanges + 3 + k], c);
        g.sh[i * each + k] = static_cast<float>((c - 0.5) / scene::kSh0);
    }
    g.opacity_logits[i] = opacity_logit(static_cast<std::uint8_t>(color & 255U));
    decode_rotation(rotation, g.rotations.data() + i * 4);
}

/// 8 (x - 0.5), where the outermost bytes are 0 and 1 and the others the middles of 1/256.
float decode_band(std::uint8_t byte) {
    const double x = byte == 0 ? 0 : (byte == 255 ? 1 : (byte + 0.5) / 256);
    return static_cast<float>(8 * (x - 0.5));
}

Gaussians decode(const Packed& packed) {
    Gaussians g = scene::make_gaussians(packed.words.size(), packed.degree);
    const std::size_t rest = packed.rest_each / 3;
    for (std::size_t i = 0; i < g.count(); ++i) {
        decode_gaussian(packed, i, g);
        for (std::size_t channel = 0; channel < 3; ++channel)
            for (std::size_t k = 0; k < rest; ++k)
                g.sh[(i * (rest + 1) + k + 1) * 3 + channel] =
                    decode_band(packed.rest[i * packed.rest_each + channel * rest + k]);
    }
    return g;
}

/// The number of this fraction in bits: the nearest of 0 to 2^count - 1.
std::uint32_t packed_fraction(double fraction, unsigned count) {
    const double most = (1U << count) - 1;
    return static_cast<std::uint32_t>(std::lround(std::clamp(fraction, 0.0, 1.0) * most));
}

/// Where a value lies in a range; 0 where that is empty.
double place_in(double value, double low, double high) {
    return high > low ? (value - low) / (high - low) : 0;
}

/// Three values in their ranges, as fractions_11_10_11() reads them.
std::uint32_t pack_11_10_11(const std::array<double, 3>& values, const double* low,
                            const double* high) {
    return packed_fraction(place_in(values[0], low[0], high[0]), 11) << 21U |
           packed_fraction(place_in(values[1], low[1], high[1]), 10) << 11U |
           packed_fraction(place_in(values[2], low[2], high[2]), 11);
}

/// The inverse of decode_rotation(): the sign of the largest component is taken out.
std::uint32_t pack_rotation(const float* wxyz) {
    std::size_t largest = 0;
    for (std::size_t i = 1; i < 4; ++i)
        if (std::abs(wxyz[i]) > std::abs(wxyz[largest])) largest = i;
    const double sign = wxyz[largest] < 0 ? -1 : 1;
    auto word = static_cast<std::uint32_t>(largest);
    for (std::size_t i = 0; i < 4; ++i)
        if (i != largest)
            word = word << 10U |
                   packed_fraction(sign * static_cast<double>(wxyz[i]) / std::sqrt(2.0) + 0.5, 10);
    return word;
}

/// The byte whose value decode_band() has; the middles of 1/256 are as near as half of that.
std::uint8_t encode_band(float value) {
    return static_cast<std::uint8_t>(
        std::clamp(std::floor((static_cast<double>(value) / 8 + 0.5) * 256), 0.0, 255.0));
}

/// What a chunk has a range of, in the order of kRanges: mean, log scale, colour.
std::array<std::array<double, 3>, 3> ranged_values(const Gaussians& g, std::size_t i) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    std::array<std::array<double, 3>, 3> values{};
    for (std::size_t k = 0; k < 3; ++k) {
        values[0][k] = static_cast<double>(g.means[i * 3 + k]);
        values[1][k] = static_cast<double>(g.log_scales[i * 3 + k]);
        values[2][k] = 0.5 + scene::kSh0 * static_cast<double>(g.sh[i * each + k]);
    }
    return values;
}

/// Minima and maxima, rounded to what the file holds.
Chunk chunk_of(const Gaussians& g, std::span<const std::size_t> indices) {
    Chunk chunk{};
    for (std::size_t n = 0; n < indices.size(); ++n) {
        const auto values = ranged_values(g, indices[n]);
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t k = 0; k < 3; ++k) {
                double& low = chunk[6 * a + k];
                double& high = chunk[6 * a + 3 + k];
                const auto value = static_cast<double>(static_cast<float>(values[a][k]));
                low = n == 0 ? value : std::min(low, value);
                high = n == 0 ? value : std::max(high, value);
            }
    }
    return chunk;
}

void put_words(Buffer& to, const Gaussians& g, std::size_t i, const Chunk& chunk) {
    const auto [mean, scale, color] = ranged_values(g, i);
    put(to, pack_11_10_11(mean, &chunk[0], &chunk[3]));
    put(to, pack_rotation(&g.rotations[i * 4]));
    put(to, pack_11_10_11(scale, &chunk[6], &chunk[9]));
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
        word = (word |
                packed_fraction(
                    place_in(color[k], chunk[kColorRanges + k], chunk[kColorRanges + 3 + k]), 8))
               << 8U;
    put(to, word | opacity_byte(g.opacity_logits[i]));
}

std::string compressed_header(const Gaussians& g) {
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    if (g.drawn_as.antialiased) text += kAntialiasedPly;
    text += "element chunk " + std::to_string(ceil_div(g.count(), kChunkSize)) + "\n";
    for (const char* name : kRanges) text += std::string("property float ") + name + "\n";
    text += "element vertex " + std::to_string(g.count()) + "\n";
    for (const char* name : kWords) text += std::string("property uint ") + name + "\n";
    const std::size_t rest = kRestOfDegree[g.sh_degree];
    if (rest > 0) text += "element sh " + std::to_string(g.count()) + "\n";
    for (std::size_t i = 0; i < rest; ++i)
        text += "property uchar f_rest_" + std::to_string(i) + "\n";
    return text + "end_header\n";
}

std::size_t clamped_bands(const Gaussians& g) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    std::size_t clamped = 0;
    for (std::size_t i = 0; i < g.sh.size(); ++i)
        if (i % each >= 3 && std::abs(g.sh[i]) > 4) ++clamped;
    return clamped;
}

bool has_packed_chunks(const PlyHeader& header) {
    const PlyElement* const vertex = header.find("vertex");
    return header.find("chunk") != nullptr && vertex != nullptr && vertex->find("packed_position");
}

}  // namespace

Result<bool> is_compressed_ply(Bytes file) {
    if (!is_ply(file)) return false;
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    return has_packed_chunks(header);
}

Result<LoadedScene> read_compressed_ply(Bytes file, const LoadOptions& options) {
    SPLAT_ASSIGN(const PlyHeader header, parse_ply_header(file));
    if (!has_packed_chunks(header))
        return damaged("compressed ply: no elements 'chunk' and 'vertex' with 'packed_position'");
    PlyRows rows(header, file);
    LoadReport report;
    Packed packed;
    for (const PlyElement& element : header.elements) {
        if (element.name == "chunk") {
            SPLAT_TRY(read_chunks(element, rows, packed, report));
        } else if (element.name == "vertex") {
            SPLAT_TRY(read_words(element, rows, packed, report));
        } else if (element.name == "sh") {
            SPLAT_TRY(read_rest(element, rows, packed, report));
        } else {
            SPLAT_TRY(rows.skip(element));
            report.ignored.push_back("element " + shown(element.name, 80));
        }
    }
    SPLAT_TRY(check_complete(packed));
    DecodeBudget budget(file.size(), options.limits);
    SPLAT_TRY(check_count(header.find("vertex")->count, packed.degree, options, budget,
                          "compressed ply"));
    SPLAT_ASSIGN(report.left_out, rows.rest(options.lenient));
    Gaussians gaussians = decode(packed);
    gaussians.drawn_as.antialiased = antialiased_ply(header, report);
    return finish_load(std::move(gaussians), std::move(report), scene::Frame::kRdf, options);
}

Status put_compressed_ply(const Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    SPLAT_ASSIGN(Gaussians scene, prepare_save(gaussians, scene::Frame::kRdf, options));
    SPLAT_TRY(check_numbers(scene, "compressed ply"));
    warn_of_loss("compressed ply", scene::normalise_rotations(scene), scene.count(),
                 "rotations have length 0");
    const std::size_t rest = kRestOfDegree[scene.sh_degree] / 3;
    warn_of_loss("compressed ply", clamped_bands(scene), 3 * rest * scene.count(),
                 "harmonics are beyond 4, and are clamped");
    const std::vector<std::size_t> order = scene::morton_order(scene);
    Buffer chunks, words, bands;
    words.reserve(scene.count() * std::size(kWords) * sizeof(std::uint32_t));
    bands.reserve(3 * rest * scene.count());
    for (std::size_t first = 0; first < scene.count(); first += kChunkSize) {
        const auto indices =
            std::span(order).subspan(first, std::min(kChunkSize, scene.count() - first));
        const Chunk chunk = chunk_of(scene, indices);
        for (const double value : chunk) put(chunks, static_cast<float>(value));
        for (const std::size_t i : indices) put_words(words, scene, i, chunk);
    }
    for (const std::size_t i : order)
        for (std::size_t channel = 0; channel < 3; ++channel)
            for (std::size_t k = 1; k <= rest; ++k)
                put(bands, encode_band(scene.sh[(i * (rest + 1) + k) * 3 + channel]));
    SPLAT_TRY(to.put(as_bytes(compressed_header(scene))));
    SPLAT_TRY(to.put(chunks));
    SPLAT_TRY(to.put(words));
    return to.put(bands);
}

extern const SceneFormat kCompressedPlyFormat = {
    .id = 2,
    .name = "compressed ply",
    .extension = ".compressed.ply",
    .holds = "quantised chunks of 256, as SuperSplat writes them",
    .mark = "the line 'ply'",
    .detect = is_compressed_ply,
    .read = read_compressed_ply,
    .write = put_compressed_ply,
    .says = {.antialiased = true}};

}  // namespace splat::io
