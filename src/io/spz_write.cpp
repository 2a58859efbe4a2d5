#include <algorithm>
#include <cmath>
#include <functional>

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
constexpr int kFinestFractionBits = 23;
constexpr double kEnoughSteps = 1 << 16;
constexpr double kMaxFixed = 8388607;

Status check_finite(const Gaussians& g) {
    for (std::size_t i = 0; i < g.count(); ++i)
        if (!holds_numbers(g, i))
            return error(
                Code::kInvalidArgument,
                "spz: Gaussian %zu has a value that is not finite, which the format cannot "
                "hold; remove it, or write .ply",
                i);
    return {};
}

/// Scales that a byte holds: exp(-10) to exp(5.9375), and what rounds to them.
constexpr double kLeastLogScale = -10 - 0.5 / 16, kMostLogScale = 255.5 / 16 - 10;
constexpr double kMostClamped = 0.01;  ///< largest share of the Gaussians; more make another scene

/// Errors: kInvalidArgument, with the factor that helps, if too many scales do not fit.
Status check_scales(const Gaussians& g, bool clamp) {
    std::vector<float> least(g.count()), most(g.count());
    std::size_t small = 0, large = 0;
    for (std::size_t i = 0; i < g.count(); ++i) {
        const float* const s = &g.log_scales[3 * i];
        least[i] = std::min({s[0], s[1], s[2]});
        most[i] = std::max({s[0], s[1], s[2]});
        small += static_cast<double>(least[i]) < kLeastLogScale ? 1 : 0;
        large += static_cast<double>(most[i]) > kMostLogScale ? 1 : 0;
    }
    const auto few = static_cast<std::size_t>(kMostClamped * static_cast<double>(g.count()));
    if (clamp || (small <= few && large <= few)) {
        warn_of_loss("spz", small, g.count(),
                     "Gaussians have a scale below exp(-10), and get that");
        warn_of_loss("spz", large, g.count(),
                     "Gaussians have a scale above exp(5.9375), and get that");
        return {};
    }
    const auto ranked = [few](std::vector<float>& values, auto order) {
        const auto rank = values.begin() + static_cast<std::ptrdiff_t>(few);
        std::nth_element(values.begin(), rank, values.end(), order);
        return static_cast<double>(*rank);
    };
    // A little further, because two digits are told.
    const double factor = small > few ? 1.05 * std::exp(-10 - ranked(least, std::less<>()))
                                      : 0.95 * std::exp(5.9375 - ranked(most, std::greater<>()));
    const std::string scaling = small > few && large > few
                                    ? std::string("write .ply")
                                    : splat::format("scale the scene by %.2g, write .ply", factor);
    return error(
        Code::kInvalidArgument,
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
    SPLAT_TRY(check_scales(scene, options.clamp));
    warn_of_loss("spz", scene::normalise_rotations(scene), scene.count(),
                 "rotations have length 0");
    warn_of_loss("spz", clipped_colors(scene, kColorScale), 3 * scene.count(), kClipped);
    Header header;
    header.version = options.spz_version;
    header.count = static_cast<std::uint32_t>(scene.count());
    header.degree = static_cast<std::uint8_t>(scene.sh_degree);
    SPLAT_ASSIGN(header.fraction_bits, choose_fraction_bits(scene));
    return header.version == 4 ? pack_streams(scene, header) : pack_whole(scene, header);
}

}  // namespace splat::io
