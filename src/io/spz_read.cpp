#include <algorithm>
#include <cmath>

#include "io/bytes.h"
#include "io/compress.h"
#include "io/reader.h"
#include "io/spz.h"
#include "io/spz_layout.h"
#include "scene/arrays.h"
#include "scene/vector.h"

namespace splat::io {
namespace {

using scene::Gaussians;
using scene::Quaternion;
using namespace spz;

/// Views of the arrays, and the unpacked memory behind them.
struct Arrays {
    std::array<Bytes, kArrays> views;
    std::vector<Buffer> memory;
};

Result<Header> read_header(Reader& reader) {
    Header header;
    std::uint32_t magic = 0;
    SPLAT_TRY(reader.read(magic, "magic"));
    if (magic != kSpzMagic) return error(Code::kFormat, "spz: the file does not start with 'NGSP'");
    SPLAT_TRY(reader.read(header.version, "version"));
    SPLAT_TRY(reader.read(header.count, "count"));
    SPLAT_TRY(reader.read(header.degree, "SH degree"));
    SPLAT_TRY(reader.read(header.fraction_bits, "fraction bits"));
    SPLAT_TRY(reader.read(header.flags, "flags"));
    SPLAT_TRY(reader.read(header.streams, "streams"));
    if (header.version < 1 || header.version > 4)
        return error(Code::kUnsupported, "spz: version %u, expected 1 to 4", header.version);
    if (header.degree > kMaxDegree)
        return error(Code::kFormat, "spz: SH degree %u, expected 0 to %u", header.degree,
                     kMaxDegree);
    if (header.fraction_bits > kMaxFractionBits)
        return error(Code::kFormat, "spz: %u fraction bits, expected 0 to %u", header.fraction_bits,
                     kMaxFractionBits);
    if (header.version < 4 && (header.flags & kExtensions) != 0)
        return error(Code::kUnsupported, "spz: a version %u file with extensions", header.version);
    return header;
}

Result<Arrays> split_arrays(Reader& reader, const Header& header) {
    Arrays arrays;
    const auto each = bytes_each(header);
    for (std::size_t i = 0; i < kArrays; ++i) {
        SPLAT_ASSIGN(arrays.views[i], reader.take(std::uint64_t{header.count} * each[i], "arrays"));
    }
    return arrays;
}

/// Bytes that the header does not count. Errors: kFormat, unless the reader is lenient.
Status leave_out(const std::string& found, const LoadOptions& options, LoadReport& report) {
    report.left_out = found;
    if (options.lenient) return {};
    return error(Code::kFormat,
                 "spz: %s, expected none: the header counts too few Gaussians, or something was "
                 "appended to the file; a lenient reader leaves them out",
                 found.c_str());
}

Status check_end(std::size_t left, const char* last, const LoadOptions& options,
                 LoadReport& report) {
    return left == 0 ? Status()
                     : leave_out(format("%zu bytes after the %s", left, last), options, report);
}

/// Versions 1 to 3, gzip or plain.
Result<Arrays> unpack_whole(Bytes file, const Header& header, const LoadOptions& options,
                            LoadReport& report, DecodeBudget& budget) {
    Reader plain(file, "spz");
    if (!is_gzip(file)) {
        SPLAT_TRY(plain.take(kHeaderBytes, "header").status());
        SPLAT_ASSIGN(Arrays arrays, split_arrays(plain, header));
        SPLAT_TRY(check_end(plain.left(), "last array", options, report));
        return arrays;
    }
    std::uint64_t bytes = kHeaderBytes;
    for (const std::size_t each : bytes_each(header)) bytes += std::uint64_t{header.count} * each;
    SPLAT_TRY(budget.take(bytes, 1, "spz"));
    GzipRest rest;
    SPLAT_ASSIGN(Buffer unpacked, gunzip(file, bytes, "spz", &rest));
    if (rest.inside)
        SPLAT_TRY(leave_out("bytes in the gzip data after the last array", options, report));
    SPLAT_TRY(check_end(rest.behind, "gzip data", options, report));
    Reader reader(unpacked, "spz");
    SPLAT_TRY(reader.take(kHeaderBytes, "header").status());
    SPLAT_ASSIGN(Arrays arrays, split_arrays(reader, header));
    arrays.memory.push_back(std::move(unpacked));
    return arrays;
}

/// Version 4: header, extensions, a table of packed and unpacked lengths, the zstd streams.
Result<Arrays> unpack_streams(Bytes file, const Header& header, const LoadOptions& options,
                              LoadReport& report, DecodeBudget& budget) {
    const std::size_t needed = header.degree == 0 ? kSh : kArrays;
    if (header.streams < needed)
        return error(Code::kFormat, "spz: %u streams, expected %zu", header.streams, needed);
    Reader reader(file, "spz");
    SPLAT_TRY(reader.take(kHeaderBytes, "header").status());
    std::uint32_t table = 0;
    SPLAT_TRY(reader.read(table, "table offset"));
    SPLAT_TRY(reader.take(kHeader4Bytes - kHeaderBytes - sizeof table, "header").status());
    if (table < kHeader4Bytes)
        return error(Code::kFormat, "spz: table at byte %u, expected %zu or more", table,
                     kHeader4Bytes);
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
            return error(Code::kFormat, "spz: stream %zu of %llu bytes, expected %u x %zu", i,
                         static_cast<unsigned long long>(bytes), header.count, each[i]);
        SPLAT_ASSIGN(const Bytes stream, reader.take(packed, "stream"));
        SPLAT_TRY(budget.take(bytes, 1, "spz stream"));
        SPLAT_ASSIGN(Buffer unpacked, unzstd(stream, bytes, "spz stream " + std::to_string(i)));
        arrays.memory.push_back(std::move(unpacked));
        arrays.views[i] = arrays.memory.back();
    }
    SPLAT_TRY(check_end(reader.left(), "last stream", options, report));
    return arrays;
}

float half_to_float(std::uint16_t half) {
    const double sign = (half & 0x8000U) != 0 ? -1 : 1;
    const int exponent = (half >> 10U) & 31;
    const int fraction = half & 1023;
    if (exponent == 31) return fraction != 0 ? std::nanf("") : static_cast<float>(sign * HUGE_VAL);
    if (exponent == 0) return static_cast<float>(sign * std::ldexp(fraction, -24));
    return static_cast<float>(sign * std::ldexp(1024 + fraction, exponent - 25));
}

void decode_means(Bytes from, const Header& header, Gaussians& g) {
    const double unit = std::ldexp(1.0, -header.fraction_bits);
    for (std::size_t i = 0; i < g.means.size(); ++i) {
        if (header.version == 1) {
            g.means[i] = half_to_float(number<std::uint16_t>(from.data() + i * 2));
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

}  // namespace

Result<bool> is_spz(Bytes file) {
    return is_gzip(file) || as_text(file).starts_with("NGSP");
}

Result<LoadedScene> read_spz(Bytes file, const LoadOptions& options) {
    const Buffer head = is_gzip(file) ? gunzip_head(file, kHeaderBytes) : Buffer();
    Reader reader(is_gzip(file) ? Bytes(head) : file, "spz");
    SPLAT_ASSIGN(const Header header, read_header(reader));
    if (is_gzip(file) && header.version >= 4)
        return error(Code::kFormat, "spz: version 4 inside gzip, expected zstd streams");
    DecodeBudget budget(file.size(), options.limits);
    SPLAT_TRY(check_count(header.count, std::min<std::uint32_t>(header.degree, scene::kMaxShDegree),
                          options, budget, "spz"));
    LoadReport report;
    report.version = header.version;
    if ((header.flags & kAntialiased) != 0) report.ignored.emplace_back("flag antialiased");
    if (header.degree > scene::kMaxShDegree) report.ignored.emplace_back("SH bands 4 to 4");
    SPLAT_ASSIGN(const Arrays arrays, header.version >= 4
                                          ? unpack_streams(file, header, options, report, budget)
                                          : unpack_whole(file, header, options, report, budget));
    return finish_load(decode(arrays, header), std::move(report), kSpzFrame, options);
}

}  // namespace splat::io
