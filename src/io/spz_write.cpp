#include <algorithm>
#include <cmath>

#include "io/bytes.h"
#include "io/compress.h"
#include "io/spz.h"
#include "io/spz_layout.h"
#include "scene/arrays.h"
#include "scene/vector.h"

namespace splat::io {
namespace {

using scene::Gaussians;
using namespace spz;

/// Bytes of band 1 are multiples of 8, of higher bands multiples of 16: they pack better.
constexpr int kBand1Step = 8;
constexpr int kHigherStep = 16;
constexpr int kUsualFractionBits = 12;
constexpr double kMaxFixed = 8388607;

Status check_finite(const Gaussians& g) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    for (std::size_t i = 0; i < g.count(); ++i)
        if (!all_finite(g.means, i, 3) || !all_finite(g.log_scales, i, 3) ||
            !all_finite(g.rotations, i, 4) || !all_finite(g.sh, i, each) ||
            std::isnan(g.opacity_logits[i]))
            return error(
                Code::kInvalidArgument,
                "spz: Gaussian %zu has a value that is not finite, which the format cannot "
                "hold; remove it, or write .ply",
                i);
    return {};
}

/// The finest fixed-point unit that holds every mean.
Result<std::uint8_t> choose_fraction_bits(const Gaussians& g) {
    double largest = 0;
    for (const float value : g.means)
        largest = std::max(largest, std::abs(static_cast<double>(value)));
    for (int bits = kUsualFractionBits; bits >= 0; --bits)
        if (std::ldexp(largest, bits) <= kMaxFixed) return static_cast<std::uint8_t>(bits);
    return error(
        Code::kInvalidArgument,
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

/// Array `which` of the file.
Buffer encode(const Gaussians& g, const Header& header, std::size_t which) {
    Buffer to;
    to.reserve(g.count() * bytes_each(header)[which]);
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
    return to;
}

void put_header(Buffer& to, const Header& header) {
    put(to, kSpzMagic);
    put(to, header.version);
    put(to, header.count);
    put(to, header.degree);
    put(to, header.fraction_bits);
    put(to, header.flags);
    put(to, header.streams);
}

Result<Buffer> pack_whole(const Gaussians& g, const Header& header) {
    Buffer plain;
    put_header(plain, header);
    for (std::size_t i = 0; i < kArrays; ++i) put_bytes(plain, encode(g, header, i));
    return gzip(plain);
}

Result<Buffer> pack_streams(const Gaussians& g, Header header) {
    header.streams = static_cast<std::uint8_t>(header.degree == 0 ? kSh : kArrays);
    Buffer file;
    put_header(file, header);
    put(file, static_cast<std::uint32_t>(kHeader4Bytes));
    file.resize(kHeader4Bytes);
    Buffer streams;
    for (std::size_t i = 0; i < header.streams; ++i) {
        const Buffer plain = encode(g, header, i);
        SPLAT_ASSIGN(const Buffer packed, zstd(plain));
        put(file, static_cast<std::uint64_t>(packed.size()));
        put(file, static_cast<std::uint64_t>(plain.size()));
        put_bytes(streams, packed);
    }
    put_bytes(file, streams);
    return file;
}

}  // namespace

Result<Buffer> write_spz(const Gaussians& gaussians, const SaveOptions& options) {
    if (options.spz_version != 3 && options.spz_version != 4)
        return error(Code::kUnsupported, "spz: version %u to write, expected 3 or 4",
                     options.spz_version);
    SPLAT_ASSIGN(Gaussians scene, prepare_save(gaussians, kSpzFrame, options));
    SPLAT_TRY(check_finite(scene));
    if (scene.count() > 0xFFFFFFFFU)
        return error(Code::kUnsupported, "spz: %zu Gaussians, the format counts in 32 bits",
                     scene.count());
    scene::normalise_rotations(scene);
    Header header;
    header.version = options.spz_version;
    header.count = static_cast<std::uint32_t>(scene.count());
    header.degree = static_cast<std::uint8_t>(scene.sh_degree);
    SPLAT_ASSIGN(header.fraction_bits, choose_fraction_bits(scene));
    return header.version == 4 ? pack_streams(scene, header) : pack_whole(scene, header);
}

}  // namespace splat::io
