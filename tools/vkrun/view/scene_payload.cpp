#include "vkrun/view/scene_payload.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

/// Spherical harmonic of degree 0.
const double kPackedY00 = 0.5 * std::sqrt(1 / std::numbers::pi);

/// Log scales further from the scene's size are as good as these: far below a pixel, far beyond the scene.
constexpr double kSmallest = -14, kLargest = 4;

/// Colours outside are clamped: brighter than white or darker than black in every direction.
constexpr double kDarkest = -4, kBrightest = 5;

std::vector<float> attribute(splat_scene scene, const char* name, std::uint64_t floats) {
    std::vector<float> values(floats);
    check(splat_scene_read(scene, name, values.data(), values.size() * sizeof(float)));
    return values;
}

/// The log of the scene's radius, or of the scale that one in a thousand exceeds, and no Gaussian alone, if it is
/// larger, as that of Gaussians about one point.
double log_size(const splat_scene_info& info, std::vector<float> log_scales) {
    const std::size_t last = log_scales.size() - 1;
    const std::size_t rank = std::max(last / 1000, std::min<std::size_t>(3, last / 2));
    const auto large = log_scales.begin() + static_cast<std::ptrdiff_t>(last - rank);
    std::nth_element(log_scales.begin(), large, log_scales.end());
    return std::max(std::log(std::max(info.radius, 1e-30)), static_cast<double>(*large));
}

/// Least value and extent of what is packed, within the bounds.
struct Range {
    double low = 0, extent = 0;

    Range(const std::vector<float>& values, double least, double most) {
        double from = most, to = least;
        for (const float v : values) {
            from = std::min(from, static_cast<double>(v));
            to = std::max(to, static_cast<double>(v));
        }
        low = std::clamp(from, least, most);
        extent = std::clamp(to, low, most) - low;
    }
    /// 0 to `steps`.
    [[nodiscard]] std::uint32_t code(double value, double steps) const {
        if (extent <= 0) return 0;
        return static_cast<std::uint32_t>(
            std::lround(std::clamp((value - low) / extent, 0.0, 1.0) * steps));
    }
    [[nodiscard]] Json json() const { return {low, extent}; }
};

/// Values of the codes 0, 8, 247 and 255: what is between the last two in a thousand on either side shares most codes,
/// so that a few Gaussians far brighter or darker do not make all others coarse.
class Colors {
  public:
    explicit Colors(std::vector<float> values) {
        const std::size_t last = values.size() - 1, tail = last / 1000;
        const std::size_t ranks[] = {0, tail, last - tail, last};
        for (std::size_t k = 0; k < 4; ++k) {
            const auto at = values.begin() + static_cast<std::ptrdiff_t>(ranks[k]);
            std::nth_element(values.begin(), at, values.end());
            knots_[k] = std::clamp(static_cast<double>(*at), kDarkest, kBrightest);
        }
    }
    [[nodiscard]] std::uint32_t code(double value) const {
        const std::size_t k = value < knots_[1] ? 0 : value <= knots_[2] ? 1 : 2;
        const double extent = knots_[k + 1] - knots_[k];
        const double share = extent > 0 ? std::clamp((value - knots_[k]) / extent, 0.0, 1.0) : 0.0;
        return static_cast<std::uint32_t>(
            std::lround(kCodes[k] + share * (kCodes[k + 1] - kCodes[k])));
    }
    [[nodiscard]] Json json() const { return knots_; }

  private:
    static constexpr double kCodes[] = {0, 8, 247, 255};
    std::array<double, 4> knots_{};
};

std::uint32_t rotation_code(const float* q) {
    double unit[4], length = 0;
    for (int k = 0; k < 4; ++k) length += std::pow(static_cast<double>(q[k]), 2);
    std::uint32_t largest = 0;
    for (std::uint32_t k = 0; k < 4; ++k) {
        unit[k] = static_cast<double>(q[k]) / std::sqrt(length);
        if (std::abs(unit[k]) > std::abs(unit[largest])) largest = k;
    }
    const double sign = unit[largest] < 0 ? -1 : 1;
    std::uint32_t code = largest << 30U, shift = 0;
    for (std::uint32_t k = 0; k < 4; ++k) {
        if (k == largest) continue;
        code |= static_cast<std::uint32_t>(std::lround(sign * unit[k] * std::numbers::sqrt2 * 511) +
                                           511)
                << shift;
        shift += 10;
    }
    return code;
}

/// The `most` of largest opacity times area, in their order.
std::vector<std::size_t> most_visible(const std::vector<float>& opacities,
                                      const std::vector<float>& log_scales, std::uint64_t most) {
    std::vector<std::size_t> kept(opacities.size());
    std::iota(kept.begin(), kept.end(), 0U);
    if (kept.size() <= most) return kept;
    std::vector<float> weights(kept.size());
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const float* const s = &log_scales[3 * i];
        weights[i] = std::log(opacities[i]) + s[0] + s[1] + s[2] - std::min({s[0], s[1], s[2]});
    }
    const auto middle = kept.begin() + static_cast<std::ptrdiff_t>(most);
    std::nth_element(kept.begin(), middle, kept.end(), [&](std::size_t a, std::size_t b) {
        return weights[a] != weights[b] ? weights[a] > weights[b] : a < b;
    });
    kept.erase(middle, kept.end());
    std::sort(kept.begin(), kept.end());
    return kept;
}

/// Drops what no image shows, and says so.
splat_scene_info filter(splat_scene scene, ScenePayload& payload) {
    const auto measured = [scene] {
        auto info = sized<splat_scene_info>();
        check(splat_scene_get_info(scene, &info));
        return info;
    };
    const std::uint64_t all = measured().count;
    check(splat_scene_filter(scene, SPLAT_FILTER_FINITE, 0));
    const std::uint64_t finite = measured().count;
    check(splat_scene_filter(scene, 0, 1.0 / 255));
    const splat_scene_info info = measured();
    payload.facts["faint"] = finite - info.count;
    const auto wide = [](std::uint64_t number) { return static_cast<unsigned long long>(number); };
    constexpr const char* kDefect = "numbers that are not finite, or rotations of length 0";
    if (info.count == 0)
        throw Failure(kBadData, format("the scene has no Gaussian that can be seen: of %llu, %llu "
                                       "have %s, and %llu an opacity below 1/255",
                                       wide(all), wide(all - finite), kDefect, wide(finite)));
    if (all > finite)
        payload.notes.push_back(format("%llu of %llu Gaussians have %s; they are left out.",
                                       wide(all - finite), wide(all), kDefect));
    return info;
}

/// Codes from 0 to 127 of the absolute coefficients of one degree: limit s^2 with s = code / 127, and above the code
/// 119 also beyond (s - 119 / 127), which is 0 unless a few are so large that they would make all others coarse.
class Coefficients {
  public:
    explicit Coefficients(std::vector<float> values) {
        if (values.empty()) return;
        const std::size_t last = values.size() - 1;
        const auto large = values.begin() + static_cast<std::ptrdiff_t>(last - last / 1000);
        std::nth_element(values.begin(), large, values.end());
        const auto most = static_cast<double>(*std::max_element(large, values.end()));
        limit_ = most;
        if (const double usual = kStray * static_cast<double>(*large); usual > 0 && most > usual) {
            limit_ = usual;
            beyond_ = (most - usual) / (1 - kBend);
        }
    }
    [[nodiscard]] std::uint32_t code(double value) const {
        if (limit_ <= 0) return 0;
        const double s = std::sqrt(value / limit_);
        if (s <= kBend || beyond_ <= 0)
            return static_cast<std::uint32_t>(std::lround(std::min(s, 1.0) * 127));
        std::uint32_t nearest = kBendCode;
        for (std::uint32_t c = kBendCode + 1; c <= 127; ++c)
            if (std::abs(value_of(c) - value) < std::abs(value_of(nearest) - value)) nearest = c;
        return nearest;
    }
    [[nodiscard]] double limit() const { return limit_; }
    [[nodiscard]] double beyond() const { return beyond_; }

  private:
    static constexpr std::uint32_t kBendCode = 119;
    static constexpr double kBend = kBendCode / 127.0;
    static constexpr double kStray = 8;  ///< times what one in a thousand exceeds

    [[nodiscard]] double value_of(std::uint32_t code) const {
        const double s = code / 127.0;
        return limit_ * s * s + beyond_ * std::max(s - kBend, 0.0);
    }
    double limit_ = 0, beyond_ = 0;
};

/// Planes of coefficients after the constant one. Returns how to read those of each degree.
std::vector<Coefficients> pack_harmonics(const std::vector<float>& sh, std::uint32_t degree,
                                         const std::vector<std::size_t>& kept,
                                         std::uint32_t* words) {
    const std::size_t terms = (degree + 1) * (degree + 1);
    std::vector<Coefficients> degrees;
    for (std::size_t d = 1; d <= 3; ++d) {
        const std::size_t first = 3 * d * d, end = d > degree ? first : 3 * (d + 1) * (d + 1);
        std::vector<float> values;
        values.reserve(kept.size() * (end - first));
        for (const std::size_t i : kept)
            for (std::size_t at = first; at < end; ++at)
                values.push_back(std::abs(sh[3 * i * terms + at]));
        degrees.emplace_back(std::move(values));
    }
    for (std::size_t n = 0; n < kept.size(); ++n)
        for (std::size_t k = 1; k < terms; ++k)
            for (std::size_t c = 0; c < 3; ++c) {
                const auto value = static_cast<double>(sh[(kept[n] * terms + k) * 3 + c]);
                std::uint32_t code = degrees[k < 4 ? 0 : k < 9 ? 1 : 2].code(std::abs(value));
                if (value < 0) code = -code;  // two's complement
                const std::size_t byte = 3 * ((k - 1) % 4) + c;
                words[3 * ((k - 1) / 4 * kept.size() + n) + byte / 4] |= (code & 255U)
                                                                         << (8 * (byte % 4));
            }
    return degrees;
}

}  // namespace

ScenePayload pack_scene(splat_scene scene, std::uint64_t most) {
    ScenePayload payload;
    const splat_scene_info info = filter(scene, payload);
    payload.drawn_as = info.drawn_as;
    const std::uint64_t n = info.count;
    const std::uint32_t degree = info.sh_degree, terms = (degree + 1) * (degree + 1);
    const auto means = attribute(scene, "means", 3 * n);
    const auto log_scales = attribute(scene, "log_scales", 3 * n);
    const auto rotations = attribute(scene, "rotations", 4 * n);
    const auto opacities = attribute(scene, "opacities", n);
    const auto sh = attribute(scene, "sh", 3 * terms * n);
    const std::vector<std::size_t> kept = most_visible(opacities, log_scales, most);
    const std::size_t count = kept.size();
    if (count < n)
        payload.notes.push_back(
            format("The page holds %zu of %llu Gaussians, those of the largest opacity times area.",
                   count, static_cast<unsigned long long>(n)));

    std::vector<float> colors;
    for (const std::size_t i : kept)
        for (std::size_t c = 0; c < 3; ++c)
            colors.push_back(
                static_cast<float>(0.5 + kPackedY00 * static_cast<double>(sh[3 * terms * i + c])));
    const double size = log_size(info, log_scales);
    const Range scale(log_scales, size + kSmallest, size + kLargest);
    const auto cut = std::count_if(kept.begin(), kept.end(), [&](std::size_t i) {
        return static_cast<double>(*std::max_element(&log_scales[3 * i], &log_scales[3 * i] + 3)) >
               size + kLargest;
    });
    if (cut > 0)
        payload.notes.push_back(
            format("%zu of the page's %zu Gaussians are larger than %.0f times the scene; the page "
                   "has them of that size.",
                   static_cast<std::size_t>(cut), count, std::exp(kLargest)));
    const Colors color(colors);
    constexpr std::size_t kPlanes[] = {2, 3, 4, 6};
    payload.words.resize(kPlanes[degree] * 3 * count);
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t i = kept[k];
        std::uint32_t* const mean = &payload.words[3 * k];
        std::uint32_t* const shape = &payload.words[3 * (count + k)];
        for (std::size_t c = 0; c < 3; ++c)
            mean[c] = std::bit_cast<std::uint32_t>(means[3 * i + c]);
        for (std::size_t c = 0; c < 3; ++c) {
            shape[0] |= scale.code(static_cast<double>(log_scales[3 * i + c]), c < 2 ? 2047 : 1023)
                        << (11 * c);
            shape[2] |= color.code(static_cast<double>(colors[3 * k + c])) << (8 * c);
        }
        shape[1] = rotation_code(&rotations[4 * i]);
        shape[2] |= static_cast<std::uint32_t>(std::lround(255 * opacities[i])) << 24U;
    }
    Json limits = Json::array(), beyond = Json::array();
    for (const Coefficients& of :
         pack_harmonics(sh, degree, kept, payload.words.data() + 6 * count)) {
        limits.push_back(of.limit());
        beyond.push_back(of.beyond());
    }
    payload.facts.update({{"count", count},
                          {"degree", degree},
                          {"log_scale", scale.json()},
                          {"color", color.json()},
                          {"sh_limit", limits},
                          {"sh_beyond", beyond},
                          {"center", info.center},
                          {"radius", info.radius}});
    return payload;
}

}  // namespace vkrun
