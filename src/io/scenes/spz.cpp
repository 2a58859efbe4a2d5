#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "io/compress.h"
#include "io/number_type.h"
#include "io/reader.h"
#include "scene/arrays.h"
#include "scene/vector.h"

namespace splat::io {
namespace {

using scene::Gaussians;
using scene::Quaternion;

constexpr std::uint32_t kSpzMagic = 0x5053474E;  ///< "NGSP"
constexpr std::size_t kHeaderBytes = 16;         ///< versions 1 to 3
constexpr std::size_t kHeader4Bytes = 32;        ///< version 4: more fields, then zeros
constexpr std::uint8_t kAntialiased = 1;         ///< flags
constexpr std::uint8_t kExtensions = 2;
constexpr std::uint8_t kMaxDegree = 4;
constexpr std::uint8_t kMaxFractionBits = 24;

constexpr double kColorScale = 0.15;  ///< byte = 255 (0.5 + 0.15 sh[0])
constexpr double kSqrtHalf = 0.70710678118654752;

/// The bytes of a file behind the magic number.
struct Header {
    std::uint32_t version = 0;
    std::uint32_t count = 0;
    std::uint8_t degree = 0;
    std::uint8_t fraction_bits = 0;
    std::uint8_t flags = 0;
    std::uint8_t streams = 0;  ///< version 4
};
static_assert(sizeof(Header) == 12);

/// The arrays, in the order of the file.
enum Array : std::size_t { kMeans, kOpacities, kColors, kScales, kRotations, kSh, kArrays };

/// Bytes for each Gaussian of each array.
std::array<std::size_t, kArrays> bytes_each(const Header& header) {
    const std::size_t degree = header.degree;
    return {
        header.version == 1 ? std::size_t{6} : 9, 1, 3, 3, header.version >= 3 ? std::size_t{4} : 3,
        3 * ((degree + 1) * (degree + 1) - 1)};
}

/// Views of the arrays, and the unpacked memory behind them.
struct Arrays {
    std::array<Bytes, kArrays> views;
    std::vector<Buffer> memory;
};

Result<Header> read_header(Reader& reader) {
    Header header;
    std::uint32_t magic = 0;
    SPLAT_TRY(reader.read(magic, "magic"));
    if (magic != kSpzMagic) return damaged("spz: the file does not start with 'NGSP'");
    SPLAT_TRY(reader.read(header, "header"));
    if (header.version < 1 || header.version > 4)
        return unsupported("spz: version %u, expected 1 to 4", header.version);
    if (header.degree > kMaxDegree)
        return damaged("spz: SH degree %u, expected 0 to %u", header.degree, kMaxDegree);
    if (header.fraction_bits > kMaxFractionBits)
        return damaged("spz: %u fraction bits, expected 0 to %u", header.fraction_bits,
                       kMaxFractionBits);
    if (header.version < 4 && (header.flags & kExtensions) != 0)
        return unsupported("spz: a version %u file with extensions", header.version);
    return header;
}

/// Bytes that the header does not count. Errors: kFormat, unless the reader is lenient.
Status leave_out(const std::string& found, const LoadOptions& options, LoadReport& report) {
    report.left_out = found;
    if (options.lenient) return {};
    return damaged(
        "spz: %s, expected none: the header counts too few Gaussians, or something was "
        "appended to the file; a lenient reader leaves them out",
        found.c_str());
}

Status check_end(std::size_t left, const char* last, const LoadOptions& options,
                 LoadReport& report) {
    if (left == 0) return {};
    return leave_out(format("%zu bytes after the %s", left, last), options, report);
}

/// Versions 1 to 3, gzip or plain.
Result<Arrays> unpack_whole(Bytes file, const Header& header, const LoadOptions& options,
                            LoadReport& report, DecodeBudget& budget) {
    Arrays arrays;
    if (is_gzip(file)) {
        std::uint64_t bytes = kHeaderBytes;
        for (const std::size_t each : bytes_each(header))
            bytes += std::uint64_t{header.count} * each;
        SPLAT_TRY(budget.take(bytes, 1, "spz"));
        GzipRest rest;
        SPLAT_ASSIGN(Buffer unpacked, gunzip(file, bytes, "spz", &rest));
        if (rest.inside)
            SPLAT_TRY(leave_out("bytes in the gzip data after the last array", options, report));
        SPLAT_TRY(check_end(rest.behind, "gzip data", options, report));
        arrays.memory.push_back(std::move(unpacked));
        file = arrays.memory.back();
    }
    Reader reader(file, "spz");
    SPLAT_TRY(reader.take(kHeaderBytes, "header").status());
    const auto each = bytes_each(header);
    for (std::size_t i = 0; i < kArrays; ++i)
        SPLAT_SET(arrays.views[i], reader.take(std::uint64_t{header.count} * each[i], "arrays"));
    SPLAT_TRY(check_end(reader.left(), "last array", options, report));
    return arrays;
}

/// Version 4: header, extensions, a table of packed and unpacked lengths, the zstd streams.
Result<Arrays> unpack_streams(Bytes file, const Header& header, const LoadOptions& options,
                              LoadReport& report, DecodeBudget& budget) {
    const std::size_t needed = header.degree == 0 ? kSh : kArrays;
    if (header.streams < needed)
        return damaged("spz: %u streams, expected %zu", header.streams, needed);
    Reader reader(file, "spz");
    SPLAT_TRY(reader.take(kHeaderBytes, "header").status());
    std::uint32_t table = 0;
    SPLAT_TRY(reader.read(table, "table offset"));
    SPLAT_TRY(reader.take(kHeader4Bytes - kHeaderBytes - sizeof table, "header").status());
    if (table < kHeader4Bytes)
        return damaged("spz: table at byte %u, expected %zu or more", table, kHeader4Bytes);
    if (table > kHeader4Bytes) report.ignored.emplace_back("extensions");
    SPLAT_TRY(reader.take(table - kHeader4Bytes, "extensions").status());
    SPLAT_ASSIGN(const Bytes rows, reader.take(std::uint64_t{header.streams} * 16, "table"));
    if (header.streams > kArrays) report.ignored.emplace_back("additional streams");
    Arrays arrays;
    const auto each = bytes_each(header);
    for (std::size_t i = 0; i < header.streams; ++i) {
        const auto packed = number<std::uint64_t>(rows.data() + i * 16);
        if (i >= kArrays) {
            SPLAT_TRY(reader.take(packed, "additional stream").status());
            continue;
        }
        const auto bytes = number<std::uint64_t>(rows.data() + i * 16 + 8);
        if (bytes != std::uint64_t{header.count} * each[i])
            return damaged("spz: stream %zu of %llu bytes, expected %u x %zu", i, llu(bytes),
                           header.count, each[i]);
        SPLAT_ASSIGN(const Bytes stream, reader.take(packed, "stream"));
        SPLAT_TRY(budget.take(bytes, 1, "spz stream"));
        SPLAT_ASSIGN(Buffer unpacked, unzstd(stream, bytes, "spz stream " + std::to_string(i)));
        arrays.memory.push_back(std::move(unpacked));
        arrays.views[i] = arrays.memory.back();
    }
    SPLAT_TRY(check_end(reader.left(), "last stream", options, report));
    return arrays;
}

void decode_means(Bytes from, const Header& header, Gaussians& g) {
    const double unit = std::ldexp(1.0, -header.fraction_bits);
    for (std::size_t i = 0; i < g.means.size(); ++i) {
        if (header.version == 1) {
            g.means[i] = from_half(number<std::uint16_t>(from.data() + i * 2));
            continue;
        }
        const std::byte* const at = from.data() + i * 3;
        const std::uint32_t bits = number<std::uint16_t>(at) | std::to_integer<std::uint32_t>(at[2])
                                                                   << 16U;
        const int fixed = static_cast<int>(bits ^ 0x800000U) - 0x800000;  // sign of 24 bits
        g.means[i] = static_cast<float>(fixed * unit);
    }
}

/// From version 3: index of the largest of x y z w in the top bits, then sign and 9 bits for each
/// other component, the last of them lowest.
Quaternion decode_smallest_three(std::uint32_t packed) {
    std::array<double, 4> xyzw{};
    const std::size_t largest = packed >> 30U;
    double squared = 0;
    for (std::size_t i = 4; i-- > 0;) {
        if (i == largest) continue;
        const double magnitude = kSqrtHalf * (packed & 511U) / 511;
        xyzw[i] = (packed & 512U) != 0 ? -magnitude : magnitude;
        squared += magnitude * magnitude;
        packed >>= 10U;
    }
    xyzw[largest] = std::sqrt(std::max(0.0, 1 - squared));
    return {xyzw[3], xyzw[0], xyzw[1], xyzw[2]};
}

/// Before version 3: x, y, z; w is not negative.
Quaternion decode_first_three(const std::byte* at) {
    std::array<double, 3> xyz{};
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        xyz[k] = std::to_integer<int>(at[k]) / 127.5 - 1;
        squared += xyz[k] * xyz[k];
    }
    return {std::sqrt(std::max(0.0, 1 - squared)), xyz[0], xyz[1], xyz[2]};
}

void decode_rotations(Bytes from, const Header& header, Gaussians& g) {
    for (std::size_t i = 0; i < g.count(); ++i) {
        const Quaternion q = header.version >= 3
                                 ? decode_smallest_three(number<std::uint32_t>(from.data() + i * 4))
                                 : decode_first_three(from.data() + i * 3);
        for (std::size_t k = 0; k < 4; ++k) g.rotations[i * 4 + k] = static_cast<float>(q[k]);
    }
}

void decode_colors(const Arrays& arrays, const Header& header, Gaussians& g) {
    const std::size_t file_rest = bytes_each(header)[kSh];
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    const auto byte = [](Bytes from, std::size_t i) { return std::to_integer<int>(from[i]); };
    for (std::size_t i = 0; i < g.count(); ++i) {
        float* const sh = g.sh.data() + i * each;
        for (std::size_t k = 0; k < 3; ++k)
            sh[k] = static_cast<float>((byte(arrays.views[kColors], i * 3 + k) / 255.0 - 0.5) /
                                       kColorScale);
        for (std::size_t k = 3; k < each; ++k)
            sh[k] =
                static_cast<float>((byte(arrays.views[kSh], i * file_rest + k - 3) - 128) / 128.0);
    }
}

Gaussians decode(const Arrays& arrays, const Header& header) {
    Gaussians g = scene::make_gaussians(
        header.count, std::min<std::uint32_t>(header.degree, scene::kMaxShDegree));
    decode_means(arrays.views[kMeans], header, g);
    decode_rotations(arrays.views[kRotations], header, g);
    decode_colors(arrays, header, g);
    for (std::size_t i = 0; i < g.log_scales.size(); ++i)
        g.log_scales[i] =
            static_cast<float>(std::to_integer<int>(arrays.views[kScales][i]) / 16.0 - 10);
    for (std::size_t i = 0; i < g.count(); ++i)
        g.opacity_logits[i] =
            opacity_logit(std::to_integer<std::uint8_t>(arrays.views[kOpacities][i]));
    return g;
}

/// Bytes of band 1 are multiples of 8, of higher bands multiples of 16: they pack better.
constexpr int kBand1Step = 8;
constexpr int kHigherStep = 16;
constexpr int kUsualFractionBits = 12;
constexpr int kFinestFractionBits = 23;
constexpr double kEnoughSteps = 1 << 16;
constexpr double kMaxFixed = 8388607;

/// Scales that a byte holds: exp(-10) to exp(5.9375), and what rounds to them.
constexpr double kLeastLogScale = -10 - 0.5 / 16, kMostLogScale = 255.5 / 16 - 10;
constexpr double kMostClamped = 0.01;  ///< largest share of the Gaussians; more make another scene

/// The least or the largest scale of Gaussian i.
float end_of_scales(const Gaussians& g, std::size_t i, bool largest) {
    const auto [least, most] = std::minmax_element(&g.log_scales[3 * i], &g.log_scales[3 * i] + 3);
    return largest ? *most : *least;
}

/// Errors: kInvalidArgument, with the factor that helps, if too many scales do not fit.
Status check_scales(const Gaussians& g, bool clamp) {
    std::size_t small = 0, large = 0;
    for (std::size_t i = 0; i < g.count(); ++i) {
        small += static_cast<double>(end_of_scales(g, i, false)) < kLeastLogScale ? 1 : 0;
        large += static_cast<double>(end_of_scales(g, i, true)) > kMostLogScale ? 1 : 0;
    }
    const auto few = static_cast<std::size_t>(kMostClamped * static_cast<double>(g.count()));
    if (clamp || (small <= few && large <= few)) {
        warn_of_loss("spz", small, g.count(),
                     "Gaussians have a scale below exp(-10), and get that");
        warn_of_loss("spz", large, g.count(),
                     "Gaussians have a scale above exp(5.9375), and get that");
        return {};
    }
    const auto ranked = [&](bool largest, auto order) {
        std::vector<float> values(g.count());
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = end_of_scales(g, i, largest);
        const auto rank = values.begin() + static_cast<std::ptrdiff_t>(few);
        std::nth_element(values.begin(), rank, values.end(), order);
        return static_cast<double>(*rank);
    };
    // A little further, because two digits are told.
    const double factor = small > few ? 1.05 * std::exp(-10 - ranked(false, std::less<>()))
                                      : 0.95 * std::exp(5.9375 - ranked(true, std::greater<>()));
    const std::string scaling = small > few && large > few
                                    ? std::string("write .ply")
                                    : splat::format("scale the scene by %.2g, write .ply", factor);
    return invalid(
        "spz: %zu of %zu Gaussians have a scale that the format does not hold, exp(-10) to "
        "exp(5.9375); %s, or let the scales be clamped",
        std::max(small, large), g.count(), scaling.c_str());
}

/// The fixed-point unit: the usual one, coarser where that does not hold every mean, finer for small scenes, down to
/// 2^-16 of the largest.
Result<std::uint8_t> choose_fraction_bits(const Gaussians& g) {
    double largest = 0;
    for (const float value : g.means)
        largest = std::max(largest, std::abs(static_cast<double>(value)));
    int finest = kUsualFractionBits;
    while (finest < kFinestFractionBits && largest > 0 &&
           std::ldexp(largest, finest) < kEnoughSteps)
        ++finest;
    for (int bits = finest; bits >= 0; --bits)
        if (std::ldexp(largest, bits) <= kMaxFixed) return static_cast<std::uint8_t>(bits);
    return invalid(
        "spz: a mean is %g units from the origin, the format holds up to %g; scale the scene",
        largest, kMaxFixed);
}

void put_means(Buffer& to, const Gaussians& g, std::uint8_t fraction_bits) {
    for (const float value : g.means) {
        const auto fixed = static_cast<std::uint32_t>(
            std::lround(std::ldexp(static_cast<double>(value), fraction_bits)));
        for (const unsigned shift : {0U, 8U, 16U})
            to.push_back(static_cast<std::byte>(fixed >> shift));
    }
}

std::uint32_t smallest_three(const float* wxyz) {
    const std::array<double, 4> q = {static_cast<double>(wxyz[1]), static_cast<double>(wxyz[2]),
                                     static_cast<double>(wxyz[3]), static_cast<double>(wxyz[0])};
    std::size_t largest = 0;
    for (std::size_t i = 1; i < 4; ++i)
        if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
    auto packed = static_cast<std::uint32_t>(largest);
    for (std::size_t i = 0; i < 4; ++i) {
        if (i == largest) continue;
        const bool negative = (q[i] < 0) != (q[largest] < 0);
        const auto magnitude = std::min(511L, std::lround(511 * std::abs(q[i]) / kSqrtHalf));
        packed = (packed << 10U) | (negative ? 512U : 0U) | static_cast<std::uint32_t>(magnitude);
    }
    return packed;
}

std::uint8_t band_byte(float value, int step) {
    return to_byte(step * std::round((128 * static_cast<double>(value) + 128) / step));
}

/// Appends to array `which` of the file.
void encode(Buffer& to, const Gaussians& g, const Header& header, std::size_t which) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    if (which == kMeans) put_means(to, g, header.fraction_bits);
    for (std::size_t i = 0; i < g.count(); ++i) {
        const float* const sh = g.sh.data() + i * each;
        if (which == kOpacities) put(to, opacity_byte(g.opacity_logits[i]));
        if (which == kRotations) put(to, smallest_three(g.rotations.data() + i * 4));
        if (which == kColors)
            for (std::size_t k = 0; k < 3; ++k)
                put(to, to_byte(255 * (0.5 + kColorScale * static_cast<double>(sh[k]))));
        if (which == kScales)
            for (std::size_t k = 0; k < 3; ++k)
                put(to, to_byte(16 * (10 + static_cast<double>(g.log_scales[i * 3 + k]))));
        if (which == kSh)
            for (std::size_t k = 3; k < each; ++k)
                put(to, band_byte(sh[k], k < 12 ? kBand1Step : kHigherStep));
    }
}

void put_header(Buffer& to, const Header& header) {
    put(to, kSpzMagic);
    put(to, header);
}

/// The arrays of a file, which take a third of the Gaussians' memory or less.
using Plain = std::array<Buffer, kArrays>;

Result<Plain> encode_all(const Gaussians& gaussians, const SaveOptions& options,
                         const Header& header) {
    Plain plain;
    for (std::size_t i = 0; i < kArrays; ++i)
        plain[i].reserve(gaussians.count() * bytes_each(header)[i]);
    std::size_t bad_rotations = 0;
    const auto encode_block = [&](Gaussians& block, std::size_t) -> Status {
        bad_rotations += scene::normalise_rotations(block);
        for (std::size_t i = 0; i < kArrays; ++i) encode(plain[i], block, header, i);
        return {};
    };
    SPLAT_TRY(for_saved_blocks(gaussians, kSpzFrame, options, encode_block));
    warn_of_loss("spz", bad_rotations, gaussians.count(), "rotations have length 0");
    return plain;
}

Status pack_whole(const Plain& plain, const Header& header, ByteSink& to) {
    GzipSink packed(to);
    Buffer head;
    put_header(head, header);
    SPLAT_TRY(packed.put(head));
    for (const Buffer& array : plain) SPLAT_TRY(packed.put(array));
    return packed.finish();
}

Status pack_streams(Plain plain, Header header, ByteSink& to) {
    header.streams = static_cast<std::uint8_t>(header.degree == 0 ? kSh : kArrays);
    Buffer head;
    put_header(head, header);
    put(head, static_cast<std::uint32_t>(kHeader4Bytes));
    head.resize(kHeader4Bytes);
    for (std::size_t i = 0; i < header.streams; ++i) {
        SPLAT_ASSIGN(Buffer packed, zstd(plain[i]));
        put(head, static_cast<std::uint64_t>(packed.size()));
        put(head, static_cast<std::uint64_t>(plain[i].size()));
        plain[i] = std::move(packed);
    }
    SPLAT_TRY(to.put(head));
    for (std::size_t i = 0; i < header.streams; ++i) SPLAT_TRY(to.put(plain[i]));
    return {};
}

}  // namespace

Result<bool> is_spz(Bytes file) {
    return is_gzip(file) || as_text(file).starts_with("NGSP");
}

Result<LoadedScene> read_spz(Bytes file, const LoadOptions& options) {
    const Buffer head = is_gzip(file) ? gunzip_head(file, kHeaderBytes) : Buffer();
    Reader reader(is_gzip(file) ? Bytes(head) : file, "spz");
    SPLAT_ASSIGN(const Header header, read_header(reader));
    if (is_gzip(file) && header.version >= 4)
        return damaged("spz: version 4 inside gzip, expected zstd streams");
    DecodeBudget budget(file.size(), options.limits);
    SPLAT_TRY(check_count(header.count, std::min<std::uint32_t>(header.degree, scene::kMaxShDegree),
                          options, budget, "spz"));
    LoadReport report;
    report.version = header.version;
    if (header.degree > scene::kMaxShDegree) report.ignored.push_back(dropped_bands(header.degree));
    SPLAT_ASSIGN(const Arrays arrays, header.version >= 4
                                          ? unpack_streams(file, header, options, report, budget)
                                          : unpack_whole(file, header, options, report, budget));
    Gaussians gaussians = decode(arrays, header);
    gaussians.drawn_as.antialiased = (header.flags & kAntialiased) != 0;
    return finish_load(std::move(gaussians), std::move(report), kSpzFrame, options);
}

std::uint64_t scales_beyond_spz(const Gaussians& g) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < g.count(); ++i) {
        const float* const first = &g.log_scales[3 * i];
        if (std::any_of(first, first + 3, [](float value) {
                const auto log_scale = static_cast<double>(value);
                return log_scale < kLeastLogScale || log_scale > kMostLogScale;
            }))
            ++count;
    }
    return count;
}

Status put_spz(const Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    if (options.spz_version != 3 && options.spz_version != 4)
        return unsupported("spz: version %u to write, expected 3 or 4", options.spz_version);
    SPLAT_TRY(for_saved_blocks(gaussians, kSpzFrame, options,
                               [](const Gaussians& block, std::size_t first) {
                                   return check_numbers(block, "spz", first);
                               }));
    if (gaussians.count() > 0xFFFFFFFFU)
        return unsupported("spz: %zu Gaussians, the format counts in 32 bits", gaussians.count());
    SPLAT_TRY(check_scales(gaussians, options.clamp));
    warn_of_loss("spz", clipped_colors(gaussians, kColorScale), 3 * gaussians.count(), kClipped);
    Header header;
    header.version = options.spz_version;
    header.count = static_cast<std::uint32_t>(gaussians.count());
    header.degree = static_cast<std::uint8_t>(options.sh_degree.value_or(gaussians.sh_degree));
    header.flags = gaussians.drawn_as.antialiased ? kAntialiased : 0;
    SPLAT_ASSIGN(header.fraction_bits, choose_fraction_bits(gaussians));
    SPLAT_ASSIGN(Plain plain, encode_all(gaussians, options, header));
    return header.version == 4 ? pack_streams(std::move(plain), header, to)
                               : pack_whole(plain, header, to);
}

extern const SceneFormat kSpzFormat = {.id = 4,
                                       .name = "spz",
                                       .extension = ".spz",
                                       .holds = "quantised",
                                       .mark = "gzip or 'NGSP'",
                                       .detect = is_spz,
                                       .read = read_spz,
                                       .write = put_spz,
                                       .frame = kSpzFrame,
                                       .says = {.antialiased = true}};

}  // namespace splat::io
